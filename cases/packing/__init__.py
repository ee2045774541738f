"""Random packings of spheres, rods, ellipsoids and superballs (B16 chapters 2 to 4)."""

from tisim.cases.case import Case, Late
from tisim.cases.packing.scene import PACKING_SCENES, SIZES, TITLE, scene_for

CASE = Case(
    name="packing",
    title=TITLE,
    source="R. J. Baars, thesis, Utrecht University (2016), chapters 2 to 4",
    sizes=SIZES,
    scene=scene_for,
    scenes=PACKING_SCENES,
    check=Late("tisim.cases.packing.checks", "check"),
    problem=Late("tisim.cases.packing.problem", "problem"),
    variants=("densest", "superquadrics", "permeable"),
    quantities=Late("tisim.cases.packing.measures", "quantities"),
    cost_size="small",
    pictures=Late("tisim.cases.packing.figures", "pictures"),
    figures=Late("tisim.cases.packing.figures", "figures"),
)
