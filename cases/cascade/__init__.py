"""Capture by one fibre after the other: the cascade of B16 section 6.4.5."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from cases.capture import CASE as CAPTURE
from cases.cascade.scene import SIZES, scene_for
from cases.case import Case, Check
from cases.statistics import Claim
from tisim.engine.batches import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _check() -> Iterator[Check | Claim]:
    """What B16 says of cascades."""
    from cases.cascade.statistics import check

    yield from check()


def _figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """Captured fraction in time, and how much longer random cascades take."""
    from cases.cascade.figures import figures

    return figures(size, progress)


CASE = Case(
    name="cascade",
    title="Magnetic colloids captured by one fibre after the other (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), section 6.4.5",
    sizes=SIZES,
    scene=scene_for,
    check=_check,
    # A stage is a run of capture.
    quantities=CAPTURE.quantities,
    pictures=CAPTURE.pictures,
    figures=_figures,
)
