"""Magnetic colloids that a magnetised fibre captures (B16 chapter 6), and its inverse problem, a filter."""

from tisim.cases.capture.scene import SIZES, scene_for
from tisim.cases.case import Case, Late

CASE = Case(
    name="capture",
    title="Magnetic colloids captured by a magnetised fibre (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), chapter 6",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.capture.checks", "check"),
    quantities=Late("tisim.cases.capture.statistics", "quantities"),
    problem=Late("tisim.cases.capture.problem", "problem"),
    variants=("fraction", "hard", "throughput"),
    pictures=Late("tisim.cases.capture.figures", "pictures"),
    figures=Late("tisim.cases.capture.figures", "figures"),
)
