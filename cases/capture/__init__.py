"""Magnetic colloids that a magnetised fibre captures (B16 chapter 6), and its inverse problem, a filter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from cases.capture.scene import SIZES, scene_for
from cases.case import Case, Check
from cases.statistics import Claim
from optimize.problem.problem import Problem
from tisim import Scene
from tisim.accuracy import Quantity
from tisim.engine.batches import Progress
from tisim.io.reader import Frames

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _check() -> Iterator[Check | Claim]:
    """What B16 concludes of one cylinder."""
    from cases.capture.statistics import check

    yield from check()


def _quantities(scene: Scene) -> tuple[Quantity, ...]:
    """How many particles are caught."""
    from cases.capture.accuracy import quantities

    return quantities(scene)


def _pictures(found: Frames) -> Mapping[str, Figure]:
    """Trajectories and captured fraction of a run."""
    from cases.capture.figures import pictures

    return pictures(found)


def _figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """Field, capture volume, and captured fraction by angle, size and aspect ratio."""
    from cases.capture.figures import figures

    return figures(size, progress)


def _problem(size: str, variant: str) -> Problem:
    """The filter that catches the most; of size "default" only."""
    from cases.capture.problem import problem

    return problem(variant)


CASE = Case(
    name="capture",
    title="Magnetic colloids captured by a magnetised fibre (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), chapter 6",
    sizes=SIZES,
    scene=scene_for,
    check=_check,
    quantities=_quantities,
    problem=_problem,
    variants=("fraction", "hard", "throughput"),
    pictures=_pictures,
    figures=_figures,
)
