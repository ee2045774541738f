"""The inverse problem of avalanche: find grains that come to rest at a measured angle or in a measured
profile.

A design is the friction, the rolling friction and the cohesion of the grains, without a field. The misfit is
the mean squared difference between the simulated avalanche and the measurement, in units of the
uncertainties; below 1, the measurement is met within them. One angle does not determine three parameters: the
designs that meet it lie on a surface, and the table of the best designs shows some of them. A profile gives a
little more information, because the top of the slope and the run-out distance depend on friction and cohesion
in different ways.

A measurement is read from a CSV file with a heading. An angle, in degrees, is a line below the heading of
``cases/common/csv_tables.py``:

    quantity,value,uncertainty
    angle_of_repose,34.5,1.0

A profile is the height of the surface against the distance from the end of the cell against which the grains
rest, from there to beyond the foot, in any one unit of length:

    distance,height,uncertainty
    0.000,0.050,0.002
    0.010,0.046,0.002
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tisim import Result, Scene
from tisim.cases.avalanche.measures import profile, repose
from tisim.cases.avalanche.scene import IRON_DESIGN, SIZES, TITLE, scene
from tisim.cases.case import searched_size, size_named
from tisim.cases.common.csv_tables import HEADING, Measurement, measurements, read_table
from tisim.cases.common.runs import OTHER_STARTS
from tisim.errors import InputError, must
from tisim.optimize import Gene, Genome, Misfit, Objective, Problem
from tisim.plotting.cloud import cloud

ANGLE_UNITS = {"angle_of_repose": "degrees"}
PROFILE = ["distance", "height", "uncertainty"]
FEWEST = 4
"""Least number of points of a profile."""

VARIANTS = ("calibrate",)
GENES = (
    Gene("friction", "", 0.1, 1.0),
    Gene("rolling_friction", "", 0.0, 0.6),
    Gene("cohesion", "J/m^3", 0.0, 1000.0),
)
"""At the upper limit of the cohesion, the pull in a contact of softened grains equals the weight of a
grain."""
KNOWN: Mapping[str, float] = IRON_DESIGN
"""The design whose angle is the target if no file is given."""
EXAMPLE = Measurement(27.9, 3.0)
"""The angle of repose of KNOWN without a field, degrees: the mean of 16 starts, and the standard deviation of
one start, 2.8, rounded up. ``tests/benchmarks/known_slope.py`` prints both."""
MEANINGS = {"misfit": "mean squared difference from the measurement, in uncertainties"}


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
    heading, rows = read_table(path, HEADING, PROFILE)
    if heading == HEADING:
        return measurements(path, rows, ANGLE_UNITS)["angle_of_repose"]
    try:
        numbers = np.array([[float(cell) for cell in row] for row in rows]).reshape(-1, len(PROFILE))
    except ValueError:
        raise InputError(f"{path} must be of numbers below its heading; received something else") from None
    return MeasuredProfile(*numbers.T)


def simulated(result: Result, target: Target) -> dict[str, float]:
    """Return the simulated values that correspond to the target."""
    if isinstance(target, MeasuredProfile):
        return target.compared(*profile(result.state))
    return {"angle of repose": repose(result.state)}


def measured(target: Target) -> dict[str, tuple[float, float]]:
    """Return the measured values with their uncertainties."""
    if isinstance(target, MeasuredProfile):
        pairs = zip(target.height.tolist(), target.uncertainty.tolist(), strict=True)
        return dict(zip(target.names, pairs, strict=True))
    return {"angle of repose": (target.value, target.uncertainty)}


def other_runs(design: Mapping[str, float], size: str, starts: int) -> list[Scene]:
    """Return runs of a design from a number of held-out starts."""
    settings = size_named(size, SIZES).scene
    return [scene(design=design, field=0.0, seed=OTHER_STARTS + k, **settings) for k in range(starts)]


def problem(size: str = "default", variant: str = "calibrate") -> Problem:
    """Return the calibration to EXAMPLE."""
    return _problem(size, variant, EXAMPLE)


def calibration(size: str, variant: str, path: Path) -> Problem:
    """Return the calibration to the measurement in a CSV file."""
    return _problem(size, variant, read(path))


def _problem(size: str, variant: str, target: Target) -> Problem:
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    settings = searched_size(size, SIZES).scene
    plain = [np.asarray(value).tolist() for value in vars(target).values()]
    wanted = "a measured profile"
    if isinstance(target, Measurement):
        wanted = f"an angle of repose of {target.value:g} ± {target.uncertainty:g} degrees"

    def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
        shown = {"angle of repose, degrees": repose(result.state)}
        if isinstance(target, Measurement):
            shown["angle of repose as measured, degrees"] = target.value
        return shown

    return Problem(
        name=f"avalanche-{variant}" + ("" if size == "default" else f"-{size}"),
        title=f"{TITLE}: {wanted}",
        description=f"friction, rolling friction and cohesion of grains with {wanted}",
        genome=Genome(GENES),
        scene=lambda design, seed: scene(design=design, field=0.0, seed=seed, **settings),
        objective=(
            Objective("misfit", lambda result: simulated(result, target), statistic=Misfit(measured(target))),
        ),
        meanings=MEANINGS,
        picture=lambda scene, result: cloud(result),
        details=details,
        met_at=1.0,
        version=2,
        code=hashlib.sha256(json.dumps(plain).encode()).hexdigest()[:12],
    )
