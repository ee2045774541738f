"""A magnetorheological fluid in a shear cell (L21 chapter 2)."""

from tisim.cases.case import Case, Late
from tisim.cases.mrf_shear.scene import SIZES, TITLE, scene_for

CASE = Case(
    name="mrf_shear",
    title=TITLE,
    source="T. Leps, PhD thesis, Univ. of Maryland (2021), chapter 2",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.mrf_shear.checks", "check"),
    quantities=Late("tisim.cases.mrf_shear.measures", "quantities"),
    cost_size="small",
    problem=Late("tisim.cases.mrf_shear.problem", "problem"),
    variants=("front", "bounded", "field"),
    figures=Late("tisim.cases.mrf_shear.figures", "figures"),
)
