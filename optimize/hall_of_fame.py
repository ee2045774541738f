"""The best different designs so far: a ranking for one objective, the front for several."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from deap import tools

from tisim.optimize.methods.individual import Individual


class HallOfFame:
    """The hall of fame.

    individuals : the best ones, best first; a front is sorted by its first cost.
    size : largest length of a ranking; a front is kept whole. Failed designs never enter.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        self.individuals: list[Individual] = []

    def update(self, population: Iterable[Individual]) -> bool:
        """Add these individuals; return whether the best improved, or the front gained a design."""
        before = {tuple(individual): individual.fitness.values for individual in self.individuals}
        leader = self.individuals[0].fitness.values if self.individuals else ()
        different: dict[tuple[float, ...], Individual] = {}
        for individual in (*self.individuals, *population):
            if not individual.failed:
                different.setdefault(tuple(individual), individual)
        candidates = list(different.values())
        if candidates and len(candidates[0].fitness.values) > 1:
            front = tools.sortNondominated(candidates, len(candidates), first_front_only=True)[0]
            self.individuals = sorted(front, key=lambda individual: individual.fitness.values)
            return any(tuple(individual) not in before for individual in self.individuals)
        self.individuals = sorted(candidates, key=lambda individual: individual.fitness.values)[: self.size]
        return bool(self.individuals) and (not leader or self.individuals[0].fitness.values < leader)


def reported(individual: Individual) -> tuple[float, ...]:
    """Return the reported costs of a design: from held-out starts, if it has any."""
    return tuple(one.mean for one in individual.confirmed) or tuple(individual.fitness.values)


def not_dominated(front: list[Individual]) -> list[Individual]:
    """Return the designs of a front that no other dominates by reported costs, in order."""
    costs = np.array([reported(individual) for individual in front])
    no_better = np.all(costs[:, None] >= costs[None], axis=2)
    worse = np.any(costs[:, None] > costs[None], axis=2)
    return [
        individual for individual, out in zip(front, (no_better & worse).any(axis=1), strict=True) if not out
    ]


def compromise(front: list[Individual]) -> Individual:
    """Return the design of a front nearest to the best of each objective, the front's ranges scaled to 1."""
    costs = np.array([reported(individual) for individual in front])
    span = np.ptp(costs, axis=0)
    distance = np.linalg.norm((costs - costs.min(axis=0)) / np.where(span > 0, span, 1.0), axis=1)
    return front[int(np.argmin(distance))]
