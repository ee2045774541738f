"""Agglomeration in thermochemically reacting granular flow (Z04), and its inverse problem."""

from __future__ import annotations

from collections.abc import Iterator

from cases.agglomeration.accuracy import quantities
from cases.agglomeration.scene import SIZES, TITLE, scene_for
from cases.case import Case, Check
from optimize.problem.problem import Problem


def _check() -> Iterator[Check]:
    """Z04's closed forms, and what must be conserved."""
    from cases.agglomeration.checks import check

    yield from check()


def _problem(size: str, variant: str) -> Problem:
    """The flow whose grains grow the most."""
    from cases.agglomeration.problem import problem

    return problem(size, variant)


CASE = Case(
    name="agglomeration",
    title=TITLE,
    source="T. I. Zohdi, Proc. R. Soc. Lond. A 460 (2004) 3421-3445",
    sizes=SIZES,
    scene=scene_for,
    check=_check,
    quantities=quantities,
    problem=_problem,
    variants=("paper", "fragmenting"),
)
