"""A blast of charged particles in air and a magnetic field (Z16), and its inverse problem."""

from tisim.cases.blast.scene import SIZES, TITLE, scene_for
from tisim.cases.case import Case, Late

CASE = Case(
    name="blast",
    title=TITLE,
    source="T. I. Zohdi, Comput. Methods Appl. Mech. Engrg. 308 (2016) 47-72",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.blast.checks", "check"),
    quantities=Late("tisim.cases.blast.shape", "quantities"),
    problem=Late("tisim.cases.blast.problem", "problem"),
    variants=("ellipsoid", "rest"),
    pictures=Late("tisim.cases.blast.figures", "pictures"),
    figures=Late("tisim.cases.blast.figures", "figures"),
)
