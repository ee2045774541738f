"""The inverse problem of granular_bench: which grains give a measured angle of repose and discharge rate?

A design is the friction, the rolling friction and the restitution of the grains. A draw-down test is run of
it, and the misfit is the mean of the squared distances from what was measured, in uncertainties: where it is
below 1, all is met within them. Two numbers do not tell three parameters: the designs that meet them lie on a
line or in a region, of which the table of the best designs shows some, and what a search names the best is
one of them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from cases.case import size_named
from cases.granular_bench.measured import QUANTITY_UNITS, Measured, Measurement, read
from cases.granular_bench.measures import discharge, repose
from cases.granular_bench.scene import BED, SIZES, TITLE, scene
from optimize.problem.genome import Gene, Genome
from optimize.problem.problem import Problem
from tisim import Result
from tisim.errors import must
from tisim.plotting.cloud import cloud

VARIANTS = ("calibrate",)
GENES = (
    Gene("friction", "", 0.05, 1.0),
    Gene("rolling_friction", "", 0.0, 0.4),
    Gene("restitution", "", 0.2, 0.9),
)
SIMULATED = {"angle_of_repose": repose, "discharge_rate": discharge}
"""How each quantity is had of a run."""
EXAMPLE: Measured = {
    "angle_of_repose": Measurement(24.0, 1.5),
    "discharge_rate": Measurement(0.241, 0.006),
}
"""What is to be met where no file is given: what a run of NATURAL has from one start."""
MEANINGS = {"misfit": "mean of the squared distances from what was measured, in uncertainties"}


def misfit(result: Result, measured: Measured) -> float:
    """Return the mean over the measured quantities of ((simulated - measured) / uncertainty)^2."""
    parts = [one.misfit(SIMULATED[name](result)) for name, one in measured.items()]
    return sum(parts) / len(parts)


def problem(size: str = "default", variant: str = "calibrate") -> Problem:
    """Return the calibration to EXAMPLE."""
    return _problem(size, variant, EXAMPLE)


def calibration(size: str, variant: str, path: Path) -> Problem:
    """Return the calibration to the measurements of a CSV file, as ``measured`` has it."""
    return _problem(size, variant, read(path))


def _problem(size: str, variant: str, measured: Measured) -> Problem:
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    must(size != BED, "size", "that of a draw-down test", size)
    settings = size_named(size, SIZES).scene
    plain = {name: [one.value, one.uncertainty] for name, one in sorted(measured.items())}
    wanted = ", ".join(
        f"{name} {one.value:g} ± {one.uncertainty:g} {QUANTITY_UNITS[name]}" for name, one in measured.items()
    )

    def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
        shown = {}
        for name, one in measured.items():
            shown[f"{name}, {QUANTITY_UNITS[name]}"] = SIMULATED[name](result)
            shown[f"{name} as measured, {QUANTITY_UNITS[name]}"] = one.value
        return shown

    return Problem(
        name=f"granular_bench-{variant}" + ("" if size == "default" else f"-{size}"),
        title=f"{TITLE}: {wanted}",
        description=f"friction, rolling friction and restitution of grains with {wanted}",
        genome=Genome(GENES),
        scene=lambda design, seed: scene(design, seed, **settings),
        objective=lambda result: misfit(result, measured),
        symbol="misfit",
        meanings=MEANINGS,
        picture=lambda scene, result: cloud(result),
        details=details,
        code=hashlib.sha256(json.dumps(plain).encode()).hexdigest()[:12],
    )
