"""The inverse problem of granular_bench: which grains give what was measured of them?

A design is the friction, the rolling friction and the restitution of the grains. A draw-down test is run of
it, with single grains on a plate beside it, and the misfit is the mean of the squared distances from what was
measured, in uncertainties: where it is below 1, all is met within them. Each of the three needs a quantity
that tells it: the rebound tells the restitution, the sliding angle the friction, and then the heap and the
rate of discharge the rolling friction. Where less was measured designs that meet it lie on a line or in a
region, and what a search names the best is one of them; how far designs that meet it spread is reported.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from tisim.cases.case import searched_size, size_named
from tisim.cases.granular_bench.measured import QUANTITY_UNITS, Measured, Measurement, read
from tisim.cases.granular_bench.measures import discharge, repose
from tisim.cases.granular_bench.plate import rebound, scene_with_plate, sliding
from tisim.cases.granular_bench.scene import SIZES, TITLE
from tisim.cases.runs import OTHER_STARTS
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem
from tisim.optimize.problem.statistic import Misfit

from tisim import Result, Scene
from tisim.errors import must
from tisim.plotting.cloud import cloud

VARIANTS = ("calibrate",)
GENES = (
    Gene("friction", "", 0.05, 1.0),
    Gene("rolling_friction", "", 0.0, 0.4),
    Gene("restitution", "", 0.2, 0.9),
)
SIMULATED = {
    "angle_of_repose": repose,
    "discharge_rate": discharge,
    "rebound_ratio": rebound,
    "sliding_angle": sliding,
}
"""How each quantity is had of a run."""
KNOWN = {"friction": 0.4, "rolling_friction": 0.27, "restitution": 0.6}
"""The design that is to be found again where no file is given."""
UNCERTAINTIES = {
    "angle_of_repose": 2.0,
    "discharge_rate": 0.02,
    "rebound_ratio": 0.02,
    "sliding_angle": 1.0,
}
"""How well each quantity is taken to be known, in its unit: heap and rate as one run of a few hundred grains
resolves them, the others as they are measured."""
MEASURED = {
    "default": {
        "angle_of_repose": 25.9,
        "discharge_rate": 0.144,
        "rebound_ratio": 0.361,
        "sliding_angle": 21.8,
    },
    "small": {
        "angle_of_repose": 11.3,
        "discharge_rate": 0.323,
        "rebound_ratio": 0.358,
        "sliding_angle": 21.8,
    },
}
"""What KNOWN has, by size: means over some starts, which ``tests/benchmarks/draw_down.py`` prints."""
EXAMPLES: Mapping[str, Measured] = {
    size: {name: Measurement(value, UNCERTAINTIES[name]) for name, value in values.items()}
    for size, values in MEASURED.items()
}
"""What is to be met where no file is given."""
MEANINGS = {"misfit": "mean of the squared distances from what was measured, in uncertainties"}


def other_runs(design: Mapping[str, float], size: str, starts: int) -> list[Scene]:
    """Return runs of a design from so many starts that are others than those of a search."""
    settings = size_named(size, SIZES).scene
    return [scene_with_plate(design, OTHER_STARTS + k, **settings) for k in range(starts)]


def problem(size: str = "default", variant: str = "calibrate") -> Problem:
    """Return the calibration to what KNOWN has."""
    searched_size(size, SIZES)
    return calibration_to(EXAMPLES[size], size, variant)


def calibration(size: str, variant: str, path: Path) -> Problem:
    """Return the calibration to the measurements of a CSV file, as ``measured`` has it."""
    return calibration_to(read(path), size, variant)


def calibration_to(measured: Measured, size: str = "default", variant: str = "calibrate") -> Problem:
    """Return the calibration to what was measured."""
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    settings = searched_size(size, SIZES).scene
    plain = {name: [one.value, one.uncertainty] for name, one in sorted(measured.items())}
    wanted = ", ".join(
        f"{name} {one.value:g} ± {one.uncertainty:g} {QUANTITY_UNITS[name]}".strip()
        for name, one in measured.items()
    )

    def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
        shown = {}
        for name, one in measured.items():
            unit = f", {QUANTITY_UNITS[name]}" if QUANTITY_UNITS[name] else ""
            shown[f"{name}{unit}"] = SIMULATED[name](result)
            shown[f"{name} as measured{unit}"] = one.value
        return shown

    return Problem(
        name=f"granular_bench-{variant}" + ("" if size == "default" else f"-{size}"),
        title=f"{TITLE}: {wanted}",
        description=f"friction, rolling friction and restitution of grains by {', '.join(measured)}",
        genome=Genome(GENES),
        scene=lambda design, seed: scene_with_plate(design, seed, **settings),
        objective=(
            Objective(
                "misfit",
                lambda result: {name: SIMULATED[name](result) for name in measured},
                statistic=Misfit({name: (one.value, one.uncertainty) for name, one in measured.items()}),
            ),
        ),
        meanings=MEANINGS,
        picture=lambda scene, result: cloud(result),
        details=details,
        met_at=1.0,
        version=3,
        code=hashlib.sha256(json.dumps(plain).encode()).hexdigest()[:12],
    )
