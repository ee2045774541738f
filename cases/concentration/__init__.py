"""Magnetic colloids so concentrated that they form chains, drawn to a fibre (B16 section 6.4.6)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from cases.case import Case, Check
from cases.concentration.scene import SIZES, scene_for
from cases.statistics import Claim
from tisim import Scene
from tisim.accuracy import Quantity
from tisim.engine.batches import Progress
from tisim.io.reader import Frames

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _check() -> Iterator[Check | Claim]:
    """What B16 says of concentrated samples."""
    from cases.concentration.statistics import check

    yield from check()


def _quantities(scene: Scene) -> tuple[Quantity, ...]:
    """How long chains are, and how far particles get."""
    from cases.concentration.accuracy import quantities

    return quantities(scene)


def _pictures(found: Frames) -> Mapping[str, Figure]:
    """Chains, and their mean length in time."""
    from cases.concentration.figures import pictures

    return pictures(found)


def _figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """Chains by size and concentration, and captured fraction in time."""
    from cases.concentration.figures import figures

    return figures(size, progress)


CASE = Case(
    name="concentration",
    title="Concentrated magnetic colloids form chains and are captured by a fibre (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), section 6.4.6",
    sizes=SIZES,
    scene=scene_for,
    check=_check,
    quantities=_quantities,
    pictures=_pictures,
    figures=_figures,
)
