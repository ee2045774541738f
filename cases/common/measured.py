"""Measured quantities with their uncertainties, read from a CSV file as the target of a calibration.

The file has a heading and one quantity on each line, in any order:

    quantity,value,uncertainty
    angle_of_repose,24.5,1.0

The uncertainty is one standard deviation; it includes the measurement error and the scatter of a simulation
with few grains.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tisim.errors import InputError, Words, did_you_mean, must

HEADING = ["quantity", "value", "uncertainty"]


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
