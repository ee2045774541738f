"""Capture by successive fibres: the cascade of B16 section 6.4.5."""

from tisim.cases.capture import CASE as CAPTURE
from tisim.cases.cascade.scene import SIZES, scene_for
from tisim.cases.case import Case, Late

CASE = Case(
    name="cascade",
    title="Magnetic colloids captured by successive fibres (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), section 6.4.5",
    sizes=SIZES,
    scene=scene_for,
    check=Late("tisim.cases.cascade.statistics", "check"),
    # A stage is a run of capture.
    quantities=CAPTURE.quantities,
    pictures=CAPTURE.pictures,
    figures=Late("tisim.cases.cascade.figures", "figures"),
)
