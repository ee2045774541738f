"""A valve that a magnetorheological fluid jams in a field (L21 section 3.4.4), and its inverse problem."""

from tisim.cases.case import Case, Late
from tisim.cases.valve.scene import SIZES, TITLE, scene_for

CASE = Case(
    name="valve",
    title=TITLE,
    source="T. Leps, PhD thesis, Univ. of Maryland (2021), section 3.4.4",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.valve.checks", "check"),
    quantities=Late("tisim.cases.valve.measures", "quantities"),
    problem=Late("tisim.cases.valve.problem", "problem"),
    variants=("front", "field", "never"),
    figures=Late("tisim.cases.valve.figures", "figures"),
)
