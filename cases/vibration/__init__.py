"""Electromagnetically induced vibration of particles in a binder (Z13 section 4), and its inverse problem."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from cases.case import Case, Check
from cases.vibration.accuracy import quantities
from cases.vibration.scene import SIZES, TITLE, scene_for
from optimize.problem.problem import Problem
from tisim.engine.batches import Progress
from tisim.io.reader import Frames

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _check() -> Iterator[Check]:
    """Z13's numbers and slip; the centre of gravity, resonances and beats against their closed forms."""
    from cases.vibration.checks import check

    yield from check()


def _pictures(found: Frames) -> Mapping[str, Figure]:
    """What is drawn of a trajectory."""
    from cases.vibration.figures import pictures

    return pictures(found)


def _figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """The resonance curve and beats."""
    from cases.vibration.figures import figures

    return figures(size, progress)


def _problem(size: str, variant: str) -> Problem:
    """The field and the binder that answer a drive the most, or the least."""
    from cases.vibration.problem import problem

    return problem(size, variant)


CASE = Case(
    name="vibration",
    title=TITLE,
    source="T. I. Zohdi, J. Vib. Acoust. (2013), doi 10.1115/1.4023251",
    sizes=SIZES,
    scene=scene_for,
    check=_check,
    quantities=quantities,
    pictures=_pictures,
    figures=_figures,
    problem=_problem,
    variants=("resonate", "avoid"),
)
