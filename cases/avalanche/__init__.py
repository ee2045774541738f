"""Avalanches of iron grains, which a magnetic field makes steeper; calibration to a measured slope."""

from tisim.cases.avalanche.scene import SIZES, TITLE, scene_for
from tisim.cases.case import Case, Late

CASE = Case(
    name="avalanche",
    title=TITLE,
    source="L21 section 4.4",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.avalanche.checks", "check"),
    quantities=Late("tisim.cases.avalanche.measures", "quantities"),
    cost_size="small",
    problem=Late("tisim.cases.avalanche.problem", "problem"),
    variants=("calibrate",),
    calibration=Late("tisim.cases.avalanche.problem", "calibration"),
    figures=Late("tisim.cases.avalanche.figures", "figures"),
    pictures=Late("tisim.cases.avalanche.figures", "pictures"),
)
