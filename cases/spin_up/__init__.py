"""A rubble pile of magnetised grains is spun up until it breaks."""

from tisim.cases.case import Case, Late
from tisim.cases.spin_up.scene import SIZES, TITLE, scene_for

CASE = Case(
    name="spin_up",
    title=TITLE,
    source="L21 section 4.3",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.spin_up.checks", "check"),
    quantities=Late("tisim.cases.spin_up.stages", "quantities"),
    problem=Late("tisim.cases.spin_up.problem", "problem"),
    variants=("elongated",),
    figures=Late("tisim.cases.spin_up.figures", "figures"),
)
