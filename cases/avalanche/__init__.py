"""Avalanches of iron grains, which a magnetic field makes steeper; calibration to a measured slope."""

from __future__ import annotations

from cases.avalanche.accuracy import quantities
from cases.avalanche.scene import TITLE, scene_for
from cases.avalanche.sizes import SIZES
from cases.case import Case, Late

CASE = Case(
    name="avalanche",
    title=TITLE,
    source="L21 section 4.4",
    sizes=SIZES,
    scene=scene_for,
    check=Late("cases.avalanche.checks", "check"),
    quantities=quantities,
    cost_size="small",
    problem=Late("cases.avalanche.problem", "problem"),
    variants=("calibrate",),
    calibration=Late("cases.avalanche.problem", "calibration"),
    figures=Late("cases.avalanche.figures", "figures"),
)
