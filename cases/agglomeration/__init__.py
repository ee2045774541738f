"""Agglomeration in thermochemically reacting granular flow (Z04), and its inverse problem."""

from tisim.cases.agglomeration.scene import SIZES, TITLE, fields_scene_for, scene_for
from tisim.cases.case import Case, Late

CASE = Case(
    name="agglomeration",
    title=TITLE,
    source="T. I. Zohdi, Proc. R. Soc. Lond. A 460 (2004) 3421-3445",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.agglomeration.checks", "check"),
    quantities=Late("tisim.cases.agglomeration.checks", "quantities"),
    problem=Late("tisim.cases.agglomeration.problem", "problem"),
    variants=("paper", "fragmenting", "fields"),
    scenes={"fields": fields_scene_for},
)
