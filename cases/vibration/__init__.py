"""Electromagnetically induced vibration of particles in a binder (Z13 section 4), and its inverse problem."""

from tisim.cases.case import Case, Late
from tisim.cases.vibration.scene import SIZES, TITLE, scene_for

CASE = Case(
    name="vibration",
    title=TITLE,
    source="T. I. Zohdi, J. Vib. Acoust. (2013), doi 10.1115/1.4023251",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.vibration.checks", "check"),
    quantities=Late("tisim.cases.vibration.closed_forms", "quantities"),
    pictures=Late("tisim.cases.vibration.figures", "pictures"),
    spectra=Late("tisim.cases.vibration.figures", "spectra"),
    figures=Late("tisim.cases.vibration.figures", "figures"),
    problem=Late("tisim.cases.vibration.problem", "problem"),
    variants=("resonate", "avoid"),
)
