"""The measured slope of a calibration: an angle of repose or a profile, read from a CSV file with a heading.

An angle, in degrees, is a line in the format of granular_bench:

    quantity,value,uncertainty
    angle_of_repose,34.5,1.0

A profile is the height of the surface against the distance from the end of the cell against which the grains
rest, from there to beyond the foot, in any one unit of length:

    distance,height,uncertainty
    0.000,0.050,0.002
    0.010,0.046,0.002

The uncertainty is one standard deviation; it includes the measurement error and the scatter of a simulation
with few grains.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tisim.cases.granular_bench import measured
from tisim.cases.granular_bench.measured import Measurement
from tisim.errors import InputError, must

ANGLE_UNITS = {"angle_of_repose": "degrees"}
PROFILE = ["distance", "height", "uncertainty"]
FEWEST = 4
"""Least number of points of a profile."""


@dataclass(frozen=True)
class MeasuredProfile:
    """A measured profile: heights of a slope at distances from the end of its cell, with uncertainties.

    distance, height, uncertainty : shape (n,) each, all in one unit of length.
    """

    distance: np.ndarray
    height: np.ndarray
    uncertainty: np.ndarray

    def __post_init__(self) -> None:
        number = len(self.distance)
        must(number >= FEWEST, "profile", f"of {FEWEST} points or more", number)
        rises = bool((np.diff(self.distance) > 0).all() and self.distance[0] >= 0)
        must(rises, "distance", "rising, and not below 0", self.distance.tolist())
        sound = bool(np.isfinite(self.height).all() and (self.height >= 0).all() and self.height.max() > 0)
        must(sound, "height", "finite and not below 0, with some value above 0", self.height.tolist())
        known = bool(np.isfinite(self.uncertainty).all() and (self.uncertainty > 0).all())
        must(known, "uncertainty", "finite and above 0", self.uncertainty.tolist())

    @property
    def names(self) -> tuple[str, ...]:
        """Return a name for each height."""
        return tuple(f"height at {distance:.10g}" for distance in self.distance)

    def compared(self, place: np.ndarray, height: np.ndarray) -> dict[str, float]:
        """Return the heights of a simulated profile at the distances of this one, in its unit, by name.

        Both profiles are scaled by the square root of the area below them, so that heaps of any size can be
        compared if their columns had the same shape. place, height : of the simulated profile, in any unit.
        """
        scale = np.sqrt(area(place, height) / area(self.distance, self.height))
        there = np.interp(self.distance * scale, place, height, right=0.0) / scale
        return dict(zip(self.names, there.tolist(), strict=True))


def area(place: np.ndarray, height: np.ndarray) -> float:
    """Return the area below a profile; the height of its first point is continued back to 0."""
    return float(np.trapezoid(height, place) + place[0] * height[0])


Target = Measurement | MeasuredProfile
"""The target of a calibration: an angle of repose (degrees) or a profile."""


def read(path: Path) -> Target:
    """Return the target in a CSV file; InputError if the file is not CSV or contains no slope."""
    heading, rows = measured.table(path, measured.HEADING, PROFILE)
    if heading == measured.HEADING:
        return measured.measurements(path, rows, ANGLE_UNITS)["angle_of_repose"]
    try:
        numbers = np.array([[float(cell) for cell in row] for row in rows]).reshape(-1, len(PROFILE))
    except ValueError:
        raise InputError(f"{path} must be of numbers below its heading; received something else") from None
    return MeasuredProfile(*numbers.T)
