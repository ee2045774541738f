"""The inverse problem of avalanche: find grains that come to rest at a measured angle or in a measured
profile.

A design is the friction, the rolling friction and the cohesion of the grains, without a field. The misfit is
the mean squared difference between the simulated avalanche and the measurement, in units of the
uncertainties; below 1, the measurement is met within them. One angle does not determine three parameters: the
designs that meet it lie on a surface, and the table of the best designs shows some of them. A profile gives a
little more information, because the top of the slope and the run-out distance depend on friction and cohesion
in different ways.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tisim import Result, Scene
from tisim.cases.avalanche.measured import MeasuredProfile, Target, read
from tisim.cases.avalanche.measures import profile, repose
from tisim.cases.avalanche.scene import IRON_DESIGN, TITLE, scene
from tisim.cases.avalanche.sizes import SIZES
from tisim.cases.case import searched_size, size_named
from tisim.cases.granular_bench.measured import Measurement
from tisim.cases.runs import OTHER_STARTS
from tisim.errors import must
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem
from tisim.optimize.problem.statistic import Misfit
from tisim.plotting.cloud import cloud

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
    """Return the calibration to a CSV file in the format of ``measured``."""
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
