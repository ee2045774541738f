"""Avalanches of iron grains, which a magnetic field makes steeper; calibration to a measured slope."""

from __future__ import annotations

from tisim.cases.avalanche.accuracy import quantities
from tisim.cases.avalanche.scene import TITLE, scene_for
from tisim.cases.avalanche.sizes import SIZES
from tisim.cases.case import Case, Late

CASE = Case(
    name="avalanche",
    title=TITLE,
    source="L21 section 4.4",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.avalanche.checks", "check"),
    quantities=quantities,
    cost_size="small",
    problem=Late("tisim.cases.avalanche.problem", "problem"),
    variants=("calibrate",),
    calibration=Late("tisim.cases.avalanche.problem", "calibration"),
    figures=Late("tisim.cases.avalanche.figures", "figures"),
)
