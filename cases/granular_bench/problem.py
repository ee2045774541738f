"""The inverse problem of granular_bench: find grains that reproduce the measured quantities.

A design is the friction, the rolling friction and the restitution of the grains. Its simulation is a
draw-down test with single grains on a plate beside it. The misfit is the mean squared difference between
simulation and measurement, in units of the uncertainties; below 1, the measurements are met within them.

Each of the three parameters needs a quantity that determines it: the rebound determines the restitution, the
sliding angle the friction, and the heap and the discharge rate then the rolling friction. With fewer
measurements, the designs that meet them lie on a line or in a region, and the best design of a search is one
of them. The spread of the designs that meet the measurements is reported.

Measurements are read from a CSV file, as in ``cases/common/csv_tables.py``:

    quantity,value,uncertainty
    angle_of_repose,24.5,1.0
    discharge_rate,0.150,0.005
    rebound_ratio,0.36,0.02
    sliding_angle,22.0,1.0

Angles are in degrees, a discharge rate is in kg/s. A rebound ratio is the height to which a grain rebounds
from a plate divided by the height of its fall. A sliding angle is the slope of a plate at which a block of
grains begins to slide.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from tisim import Result, Scene
from tisim.cases.case import searched_size, size_named
from tisim.cases.common.csv_tables import HEADING, Measured, Measurement, measurements, read_table
from tisim.cases.common.runs import OTHER_STARTS
from tisim.cases.granular_bench.measures import discharge, repose
from tisim.cases.granular_bench.plate import rebound, scene_with_plate, sliding
from tisim.cases.granular_bench.scene import SIZES, TITLE
from tisim.errors import must
from tisim.optimize import Gene, Genome, Misfit, Objective, Problem
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
"""The function that computes each quantity from a result."""
KNOWN = {"friction": 0.4, "rolling_friction": 0.27, "restitution": 0.6}
"""The design that a search must recover if no file is given."""
UNCERTAINTIES = {
    "angle_of_repose": 2.0,
    "discharge_rate": 0.02,
    "rebound_ratio": 0.02,
    "sliding_angle": 1.0,
}
"""Assumed uncertainty of each quantity, in its unit: for heap and rate the scatter of one run with a few
hundred grains, for the others a typical measurement error."""
MEASURED = {
    "default": {
        "angle_of_repose": 25.9,
        "discharge_rate": 0.144,
        "rebound_ratio": 0.361,
        "sliding_angle": 21.8,
    },
    "small": {
        "angle_of_repose": 11.3,
        "discharge_rate": 0.317,
        "rebound_ratio": 0.358,
        "sliding_angle": 21.8,
    },
}
"""Quantities of KNOWN, by size: means over starts, for "small" over 64, which
``tests/benchmarks/draw_down.py`` prints."""
EXAMPLES: Mapping[str, Measured] = {
    size: {name: Measurement(value, UNCERTAINTIES[name]) for name, value in values.items()}
    for size, values in MEASURED.items()
}
"""The target if no file is given."""
MEANINGS = {"misfit": "mean squared difference from the measurements, in uncertainties"}

QUANTITY_UNITS = {
    "angle_of_repose": "degrees", "discharge_rate": "kg/s", "rebound_ratio": "", "sliding_angle": "degrees",
}  # fmt: skip
"""The supported quantities and their units."""


def other_runs(design: Mapping[str, float], size: str, starts: int) -> list[Scene]:
    """Return runs of a design from a number of held-out starts."""
    settings = size_named(size, SIZES).scene
    return [scene_with_plate(design, OTHER_STARTS + k, **settings) for k in range(starts)]


def problem(size: str = "default", variant: str = "calibrate") -> Problem:
    """Return the calibration to the quantities of KNOWN."""
    searched_size(size, SIZES)
    return calibration_to(EXAMPLES[size], size, variant)


def calibration(size: str, variant: str, path: Path) -> Problem:
    """Return the calibration to the measurements in a CSV file."""
    return calibration_to(read(path), size, variant)


def calibration_to(measured: Measured, size: str = "default", variant: str = "calibrate") -> Problem:
    """Return the calibration to given measurements."""
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


def read(path: Path) -> dict[str, Measurement]:
    """Return the measurements of a CSV file; InputError if it is not CSV or contains none."""
    return measurements(path, read_table(path, HEADING)[1], QUANTITY_UNITS)
