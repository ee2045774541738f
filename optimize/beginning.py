"""The beginning of a search: designs that are run first, and designs with known values."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tisim.optimize.designs_csv import Given, designs
from tisim.optimize.experiments import experiments
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.problem import Problem
from tisim.optimize.storage.record import canonical
from tisim.optimize.surrogate.ranking import best

RUN_AGAIN = 6
"""Number of the best designs of a warm start that are run before generation 0."""


@dataclass(frozen=True)
class Beginning:
    """The starting designs and known values of a search; part of its identity.

    designs : given by the user as searched genes by name. They run before generation 0, for any method.
    experiments : measured designs, which the method learns from and which are not run.
    warm : designs run by other searches, from which the method learns, too; the best of them are run together
        with the user's designs. None without a warm start.
    """

    designs: tuple[dict[str, Any], ...] = ()
    experiments: tuple[Individual, ...] = ()
    warm: tuple[Individual, ...] | None = None

    @classmethod
    def of(
        cls, problem: Problem, starting_designs: Given | None, measured: Given | None, warm_start: bool
    ) -> Beginning:
        """Return the beginning from the user's input; ``warm`` is still empty.

        InputError for designs that do not belong to the problem.
        """
        first = () if starting_designs is None else designs(starting_designs, problem)
        known = () if measured is None else experiments(measured, problem)
        return cls(first, known, () if warm_start else None)

    @property
    def learned(self) -> tuple[Individual, ...]:
        """The designs that the method learns from without running them."""
        return (*self.experiments, *(self.warm or ()))

    def first(self, problem: Problem) -> list[Individual]:
        """Return the individuals that are run before generation 0, without a fitness."""
        points = [tuple(map(float, problem.genome.encode(design))) for design in self.designs]
        points += [tuple(individual) for individual in best(problem.genome, self.warm or (), RUN_AGAIN)]
        return [Individual(point, len(problem.objectives)) for point in dict.fromkeys(points)]

    def identity(self, problem: Problem) -> dict[str, str]:
        """Return its part of the identity of a search; empty if it has no designs."""
        parts = {}
        if self.designs:
            parts["starting_designs"] = _checksum(list(self.designs))
        if self.experiments:
            parts["experiments"] = _checksum(_plain(problem, self.experiments))
        if self.warm is not None:
            parts["warm_start"] = _checksum(_plain(problem, self.warm))
        return parts


def _plain(problem: Problem, individuals: Sequence[Individual]) -> list[Any]:
    return [
        [
            problem.genome.decode(individual),
            [[one.mean, one.std, one.starts, one.reason] for one in individual.estimates],
            list(individual.limited),
        ]
        for individual in individuals
    ]


def _checksum(value: Any) -> str:
    return hashlib.sha256(canonical(value)).hexdigest()[:12]


NOTHING = Beginning()
"""The beginning without designs, experiments or a warm start."""
