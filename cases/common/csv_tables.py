"""CSV tables: results of a case as text, and measured quantities that are the target of a calibration.

A file of measurements has a heading and one quantity on each line, in any order:

    quantity,value,uncertainty
    angle_of_repose,24.5,1.0

The uncertainty is one standard deviation; it includes the measurement error and the scatter of a simulation
with few grains.
"""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tisim.errors import InputError, Words, did_you_mean, must
from tisim.files import regular_file

HEADING = ["quantity", "value", "uncertainty"]


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV; the first is the heading."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    return text.getvalue()


def read_table(path: Path, *headings: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Return the heading of a CSV file, which must be one of ``headings``, and its lines of three cells each.

    InputError if it is not such a file.
    """
    other = regular_file.irregular(path)
    must(other is None, str(path), "a CSV file that can be read", Words(other or ""))
    try:
        rows = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} must be a CSV file that can be read; received {error}") from None
    rows = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    must(
        bool(rows) and rows[0] in headings,
        f"heading of {path}",
        " or ".join(",".join(heading) for heading in headings),
        ",".join(*rows[:1] or [[]]),
    )
    for row in rows[1:]:
        must(len(row) == len(rows[0]), f"a line of {path}", "of three cells", ",".join(row))
    return rows[0], rows[1:]


@dataclass(frozen=True)
class Measurement:
    """A measurement: a value and its uncertainty, one standard deviation, in the unit of the quantity."""

    value: float
    uncertainty: float

    def __post_init__(self) -> None:
        must(math.isfinite(self.value) and self.value > 0, "value", "finite and above 0", self.value)
        sound = math.isfinite(self.uncertainty) and self.uncertainty > 0
        must(sound, "uncertainty", "finite and above 0", self.uncertainty)

    def misfit(self, simulated: float) -> float:
        """Return the squared difference between a simulated value and the measurement, in uncertainties."""
        return ((simulated - self.value) / self.uncertainty) ** 2


Measured = Mapping[str, Measurement]
"""Measurements by the name of their quantity."""


def measurements(
    path: Path, rows: Sequence[Sequence[str]], units: Mapping[str, str]
) -> dict[str, Measurement]:
    """Return the measurements in the lines of a file below its HEADING.

    units : by the names of the supported quantities. InputError if a line is not a measurement, or if there
    is none.
    """
    measured: dict[str, Measurement] = {}
    for name, *numbers in rows:
        if name not in units:
            raise InputError(
                f"quantity of {path} must be one of {', '.join(units)}; received {name}"
                f"{did_you_mean(name, units)}"
            )
        must(name not in measured, f"quantity of {path}", "given once", name)
        try:
            value, uncertainty = map(float, numbers)
        except ValueError:
            raise InputError(
                f"{name} of {path} must be a value and an uncertainty; received {','.join(numbers)}"
            ) from None
        measured[name] = Measurement(value, uncertainty)
    must(bool(measured), f"quantities of {path}", "one or more", Words("none"))
    return measured
