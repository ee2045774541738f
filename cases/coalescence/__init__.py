"""Magnetised grains coalesce into a rubble pile."""

from tisim.cases.case import Case, Late
from tisim.cases.coalescence.scene import SIZES, TITLE, scene_for

CASE = Case(
    name="coalescence",
    title=TITLE,
    source="L21 section 4.2",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.coalescence.checks", "check"),
    quantities=Late("tisim.cases.coalescence.runs", "quantities"),
    cost_size="small",
    figures=Late("tisim.cases.coalescence.figures", "figures"),
)
