"""A valve that a magnetorheological fluid jams in a field (L21 section 3.4.4), and its inverse problem."""

from __future__ import annotations

from cases.case import Case, Late
from cases.valve.accuracy import quantities
from cases.valve.scene import TITLE, scene_for
from cases.valve.sizes import SIZES

CASE = Case(
    name="valve",
    title=TITLE,
    source="T. Leps, PhD thesis, Univ. of Maryland (2021), section 3.4.4",
    sizes=SIZES,
    scene=scene_for,
    check=Late("cases.valve.checks", "check"),
    quantities=quantities,
    problem=Late("cases.valve.problem", "problem"),
    variants=("front", "field", "never"),
    figures=Late("cases.valve.figures", "figures"),
)
