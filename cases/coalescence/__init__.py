"""Magnetised grains fall together into a rubble pile."""

from __future__ import annotations

from cases.case import Case, Late
from cases.coalescence.accuracy import quantities
from cases.coalescence.scene import SIZES, TITLE, scene_for

CASE = Case(
    name="coalescence",
    title=TITLE,
    source="L21 section 4.2",
    sizes=SIZES,
    scene=scene_for,
    check=Late("cases.coalescence.checks", "check"),
    quantities=quantities,
    cost_size="small",
    figures=Late("cases.coalescence.figures", "figures"),
)
