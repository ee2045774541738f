"""Standard tests of contacts in discrete element codes; a heap from a silo; calibration."""

from tisim.cases.case import Case, Late
from tisim.cases.granular_bench.scene import BED, SIZES, TITLE, scene_for

CASE = Case(
    name="granular_bench",
    title=TITLE,
    source="Y. C. Chung and J. Y. Ooi, Granul. Matter 13 (2011) 643-656, and others",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.granular_bench.checks", "check"),
    quantities=Late("tisim.cases.granular_bench.measures", "quantities"),
    cost_size=BED,
    problem=Late("tisim.cases.granular_bench.problem", "problem"),
    variants=("calibrate",),
    calibration=Late("tisim.cases.granular_bench.problem", "calibration"),
    figures=Late("tisim.cases.granular_bench.figures", "figures"),
)
