"""A blast of charged particles in air and a magnetic field (Z16), and its inverse problem."""

from __future__ import annotations

from cases.blast.accuracy import quantities
from cases.blast.scene import SIZES, TITLE, scene_for
from cases.case import Case, Late

CASE = Case(
    name="blast",
    title=TITLE,
    source="T. I. Zohdi, Comput. Methods Appl. Mech. Engrg. 308 (2016) 47-72",
    sizes=SIZES,
    scene=scene_for,
    check=Late("cases.blast.checks", "check"),
    quantities=quantities,
    problem=Late("cases.blast.problem", "problem"),
    variants=("ellipsoid",),
    pictures=Late("cases.blast.figures", "pictures"),
    figures=Late("cases.blast.figures", "figures"),
)
