"""Statistics of a generation, for its line of the logbook: the program's own and the user's."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from deap import tools

from tisim.errors import InputError, abbreviated, must
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.faults import error_told
from tisim.optimize.problem.problem import Problem

BEFORE_STATISTICS = ("gen", "designs", "starts", "failed", "box", "recentred")
"""The columns of a logbook before its statistics."""
_SETTING = "search.statistics"
_TRIALS = 8
"""Number of dummy individuals with which the user's statistics are tested."""
Row = dict[str, float]
"""Values of one generation by column."""


def statistics(
    problem: Problem, population: Sequence[Individual], hall: Sequence[Individual]
) -> dict[str, Any]:
    """Return the fitness columns of Outcome.logbook; values of the objectives, not costs."""
    of_hall = tools.Statistics(lambda individual: individual.fitness.values)
    for k, objective in enumerate(problem.objectives):
        name = best_of(objective.label) if problem.several else "best"
        of_hall.register(name, _best, k, objective.sign)
    # The fitness of a design that violates a constraint is penalised.
    columns: dict[str, Any] = of_hall.compile([one for one in hall if not one.violation])
    if problem.several:
        return {"front": len(hall), **columns}
    of_population = tools.Statistics(lambda individual: problem.costs(individual.fitness.values)[0])
    of_population.register("mean", _of_any, np.mean)
    of_population.register("std", _of_any, np.std)
    good = [individual for individual in _successful(population) if not individual.violation]
    return columns | of_population.compile(good)


def best_of(label: str) -> str:
    """Return the heading of the best value of one of several objectives."""
    return f"best {label}"


def chapter_column(chapter: str, name: str) -> str:
    """Return the heading of a column of a chapter of the logbook in tables."""
    return f"{chapter} {name}"


class OwnStatistics:
    """The user's statistics of each generation.

    given : a deap.tools.Statistics, whose functions are columns of the logbook; a MultiStatistics, whose
        statistics are its chapters; or None. They are computed for the individuals of a generation that did
        not fail, and are NaN if all failed. A function returns a number, or one for each of several
        objectives, which are separate columns.

    InputError, before any run, if they cannot be computed or have the name of a column that exists.
    """

    def __init__(self, problem: Problem, given: Any) -> None:
        kinds = tools.Statistics | tools.MultiStatistics | None
        must(isinstance(given, kinds), _SETTING, "a deap.tools.Statistics or MultiStatistics", given)
        self.problem, self.given = problem, given
        self.chaptered = isinstance(given, tools.MultiStatistics)
        if self.chaptered:
            flat = all(isinstance(one, tools.Statistics) for one in given.values())
            must(flat, _SETTING, "a MultiStatistics of deap.tools.Statistics", dict(given))
            for chapter in given:
                must(isinstance(chapter, str) and bool(chapter), f"name in {_SETTING}", "a text", chapter)
        self.columns = {chapter: list(row) for chapter, row in self._compiled(self._trial()).items()}
        taken = {*BEFORE_STATISTICS, *statistics(problem, [], []), *problem.derived}
        names = self.columns.get("", [])
        for chapter, inside in self.columns.items():
            if chapter:
                names = [*names, chapter, *(chapter_column(chapter, name) for name in inside)]
                names += [name for name in inside if name == BEFORE_STATISTICS[0]]
        doubled = sorted({name for name in names if name in taken or names.count(name) > 1})
        rule = "of names that no other column has (a MultiStatistics has chapters of its own)"
        must(not doubled, _SETTING, rule, doubled)

    def add(self, logbook: tools.Logbook, population: Sequence[Individual]) -> None:
        """Add the statistics of a generation to its row of the logbook, which is the last one."""
        good = _successful(population)
        rows = self._compiled(good) if good else {
            chapter: dict.fromkeys(names, math.nan) for chapter, names in self.columns.items()
        }  # fmt: skip
        columns = {chapter: list(row) for chapter, row in rows.items()}
        must(columns == self.columns, _SETTING, f"of the same columns always, {self.columns}", columns)
        for chapter, row in rows.items():
            if chapter:
                # Logbook.record would replace columns of a chapter by columns of the logbook.
                logbook.chapters[chapter].record(gen=logbook[-1]["gen"], **row)
            else:
                logbook[-1].update(row)

    def _compiled(self, individuals: Sequence[Individual]) -> dict[str, Row]:
        """Return the values by chapter, which is "" for a Statistics."""
        if self.given is None:
            return {}
        try:
            found = self.given.compile(individuals)
        except Exception as error:
            rule = f"{_SETTING} must be functions of the individuals of a generation"
            raise InputError(f"{rule}; received {error_told(error)}") from error
        return {
            chapter: self._row(row) for chapter, row in (found if self.chaptered else {"": found}).items()
        }

    def _row(self, found: Mapping[str, Any]) -> Row:
        row: Row = {}
        for name, value in found.items():
            must(isinstance(name, str) and bool(name), f"name in {_SETTING}", "a text", name)
            row |= self._cells(name, value)
        return row

    def _cells(self, name: str, value: Any) -> Row:
        """Return the value of one statistic as a column, or as one for each objective."""
        try:
            numbers = np.asarray(value)
        except ValueError:  # of sequences of different lengths
            numbers = np.array(None)
        labels = [objective.label for objective in self.problem.objectives]
        rule = "return a number" + (", or one for each objective" if len(labels) > 1 else "")
        if numbers.dtype.kind not in "biuf" or numbers.size not in (1, len(labels)):
            raise InputError(f"statistic {name} must {rule}; received {abbreviated(value)}")
        cells = numbers.ravel().tolist()
        if len(cells) == 1:
            return {name: cells[0]}
        return {f"{name} {label}": cell for label, cell in zip(labels, cells, strict=True)}

    def _trial(self) -> list[Individual]:
        """Return dummy individuals of different costs."""
        rng = np.random.default_rng(0)
        points = self.problem.genome.canonical(rng.random((_TRIALS, len(self.problem.genome))))
        individuals = []
        for number, point in enumerate(points):
            individual = Individual(point, len(self.problem.objectives))
            individual.know((FitnessEstimate.certain(1.0 + number),) * len(self.problem.objectives))
            individual.limits = (FitnessEstimate.certain(0.0),) * len(self.problem.result_constraints)
            individuals.append(individual)
        return individuals


def _successful(population: Sequence[Individual]) -> list[Individual]:
    return [individual for individual in population if not individual.failed]


def _best(k: int, sign: float, costs: Sequence[Sequence[float]]) -> float:
    """Return the value of objective k with the least cost; infinitely bad if there is none."""
    return sign * min((of_all[k] for of_all in costs), default=math.inf)


def _of_any(function: Callable[[Sequence[float]], Any], values: Sequence[float]) -> float:
    """Return a statistic of values, NaN if there are none."""
    return float(function(values)) if values else math.nan
