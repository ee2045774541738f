"""Magnetic colloids in a column of randomly packed magnetised fibres (B16 chapter 7), and its inverse
problem."""

from tisim.cases.case import Case, Late
from tisim.cases.packed_filter.scene import PACKED_FILTER_SCENES, SIZES, TITLE, scene_for

CASE = Case(
    name="packed_filter",
    title=TITLE,
    source="R. J. Baars, thesis, Utrecht University (2016), chapter 7",
    sizes=SIZES,
    scene=scene_for,
    scenes=PACKED_FILTER_SCENES,
    check=Late("tisim.cases.packed_filter.checks", "check"),
    problem=Late("tisim.cases.packed_filter.problem", "problem"),
    variants=("pressure", "throughput", "select"),
    quantities=Late("tisim.cases.packed_filter.measures", "quantities"),
    cost_size="small",
    pictures=Late("tisim.cases.packed_filter.pictures", "pictures"),
    figures=Late("tisim.cases.packed_filter.figures", "figures"),
)
