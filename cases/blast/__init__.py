"""A blast of charged particles in air and a magnetic field (Z16), and its inverse problem."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from cases.blast.accuracy import quantities
from cases.blast.scene import SIZES, TITLE, scene_for
from cases.case import Case, Check
from optimize.problem.problem import Problem
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.io.reader import Frames

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _check() -> Iterator[Check]:
    """Numbers of Z16, energy at the start, and what the field does to the cloud."""
    from cases.blast.checks import check

    yield from check()


def _pictures(found: Frames) -> Mapping[str, Figure]:
    """What is drawn of a trajectory."""
    from cases.blast.figures import pictures

    return pictures(found)


def _figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """The cloud without interaction, with contact, and with near field."""
    from cases.blast.figures import figures

    return figures(size, progress)


def _problem(size: str, variant: str) -> Problem:
    """The field that gives a wanted ellipsoid."""
    from cases.blast.problem import problem

    must(variant in CASE.variants, "variant", f"one of {', '.join(CASE.variants)}", variant)
    return problem(size)


CASE = Case(
    name="blast",
    title=TITLE,
    source="T. I. Zohdi, Comput. Methods Appl. Mech. Engrg. 308 (2016) 47-72",
    sizes=SIZES,
    scene=scene_for,
    check=_check,
    quantities=quantities,
    problem=_problem,
    variants=("ellipsoid",),
    pictures=_pictures,
    figures=_figures,
)
