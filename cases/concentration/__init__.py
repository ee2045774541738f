"""Magnetic colloids in a concentration at which they form chains, attracted to a fibre (B16 section
6.4.6)."""

from tisim.cases.case import Case, Late
from tisim.cases.concentration.scene import SIZES, scene_for

CASE = Case(
    name="concentration",
    title="Concentrated magnetic colloids form chains and are captured by a fibre (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), section 6.4.6",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.concentration.statistics", "check"),
    quantities=Late("tisim.cases.concentration.statistics", "quantities"),
    pictures=Late("tisim.cases.concentration.figures", "pictures"),
    figures=Late("tisim.cases.concentration.figures", "figures"),
)
