"""Magnetic colloids so concentrated that they form chains, drawn to a fibre (B16 section 6.4.6)."""

from __future__ import annotations

from cases.case import Case, Late
from cases.concentration.scene import SIZES, scene_for

CASE = Case(
    name="concentration",
    title="Concentrated magnetic colloids form chains and are captured by a fibre (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), section 6.4.6",
    sizes=SIZES,
    scene=scene_for,
    check=Late("cases.concentration.statistics", "check"),
    quantities=Late("cases.concentration.accuracy", "quantities"),
    pictures=Late("cases.concentration.figures", "pictures"),
    figures=Late("cases.concentration.figures", "figures"),
)
