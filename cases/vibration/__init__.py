"""Electromagnetically induced vibration of particles in a binder (Z13 section 4), and its inverse problem."""

from __future__ import annotations

from cases.case import Case, Late
from cases.vibration.accuracy import quantities
from cases.vibration.scene import SIZES, TITLE, scene_for

CASE = Case(
    name="vibration",
    title=TITLE,
    source="T. I. Zohdi, J. Vib. Acoust. (2013), doi 10.1115/1.4023251",
    sizes=SIZES,
    scene=scene_for,
    check=Late("cases.vibration.checks", "check"),
    quantities=quantities,
    pictures=Late("cases.vibration.figures", "pictures"),
    figures=Late("cases.vibration.figures", "figures"),
    problem=Late("cases.vibration.problem", "problem"),
    variants=("resonate", "avoid"),
)
