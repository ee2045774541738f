"""Capture by successive fibres: the cascade of B16 section 6.4.5."""

from tisim.cases.capture import CASE as CAPTURE
from tisim.cases.cascade.scene import SIZES, TITLE, scene_for
from tisim.cases.case import Case, Late

CASE = Case(
    name="cascade",
    title=TITLE,
    source="R. J. Baars, thesis, Utrecht University (2016), section 6.4.5",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.cascade.statistics", "check"),
    # A stage is a run of capture.
    quantities=CAPTURE.quantities,
    pictures=CAPTURE.pictures,
    problem=Late("tisim.cases.cascade.problem", "problem"),
    variants=("soonest",),
    figures=Late("tisim.cases.cascade.figures", "figures"),
)
