"""Measured quantities with their uncertainties, which a calibration is to meet, as a file has them.

The file is CSV with a heading, in any order, a line each:

    quantity,value,uncertainty
    angle_of_repose,24.5,1.0
    discharge_rate,0.150,0.005
    rebound_ratio,0.36,0.02
    sliding_angle,22.0,1.0

Angles are in degrees, a discharge rate in kg/s. A rebound ratio is the height to which a grain rebounds from
a plate over that of its fall; at a sliding angle a block of grains begins to slide on a plate. The
uncertainty is one standard deviation, of the measurement and of what a simulation of so few grains can
resolve.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tisim.errors import InputError, Words, did_you_mean, must
from tisim.files import regular_file

QUANTITY_UNITS = {
    "angle_of_repose": "degrees", "discharge_rate": "kg/s", "rebound_ratio": "", "sliding_angle": "degrees",
}  # fmt: skip
"""The quantities that may be measured, and their units."""
HEADING = ["quantity", "value", "uncertainty"]


@dataclass(frozen=True)
class Measurement:
    """A measurement is a value and its uncertainty, one standard deviation, in the unit of the quantity."""

    value: float
    uncertainty: float

    def __post_init__(self) -> None:
        must(math.isfinite(self.value) and self.value > 0, "value", "finite and above 0", self.value)
        sound = math.isfinite(self.uncertainty) and self.uncertainty > 0
        must(sound, "uncertainty", "finite and above 0", self.uncertainty)

    def misfit(self, simulated: float) -> float:
        """Return how far a simulated value is from it, squared, in uncertainties."""
        return ((simulated - self.value) / self.uncertainty) ** 2


Measured = Mapping[str, Measurement]
"""Measurements by the name of their quantity."""


def table(path: Path, *headings: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Return the heading of a CSV file, one of some of three cells, and its lines; InputError where it is no
    such file."""
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


def read(path: Path) -> dict[str, Measurement]:
    """Return the measurements of a CSV file; InputError where it is none, or there is nothing in it."""
    return measurements(path, table(path, HEADING)[1], QUANTITY_UNITS)


def measurements(
    path: Path, rows: Sequence[Sequence[str]], units: Mapping[str, str]
) -> dict[str, Measurement]:
    """Return the measurements of the lines of a file below its HEADING, of the quantities that have
    ``units``; InputError where one is none, or there are none."""
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
