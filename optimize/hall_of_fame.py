"""The best different designs so far: a ranking for one objective, the front for several."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from deap import tools

from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.problem import Problem


class HallOfFame(tools.HallOfFame):
    """DEAP's hall of fame for one objective: the best different designs, at most ``maxsize``.

    items : the individuals, best first. They are the individuals of the search; ``insert`` alone copies.
    keys : their fitnesses, worst first, as in DEAP. At the end of a noisy search the ranking uses more than
        these fitnesses (see optimize.conclusion), so the keys are in the order of the ranking.

    Failed designs never enter by ``update``.
    """

    def __init__(self, maxsize: int | None) -> None:
        tools.HallOfFame.__init__(self, maxsize)

    @property
    def individuals(self) -> list[Individual]:
        """The individuals, best first."""
        return list(self.items)

    def fill(self, individuals: Iterable[Individual]) -> None:
        """Replace all individuals by these, in their order."""
        self.items = list(individuals)
        self.keys = [individual.fitness for individual in reversed(self.items)]

    def update(self, population: Iterable[Individual]) -> bool:
        """Add these individuals; return whether the best improved, or the front gained a design."""
        before = [(tuple(individual), individual.fitness.values) for individual in self.items]
        different: dict[tuple[float, ...], Individual] = {}
        for individual in (*self.items, *population):
            if not individual.failed:
                different.setdefault(tuple(individual), individual)
        self.fill(self._chosen(list(different.values())))
        return self._improved(before)

    def _chosen(self, candidates: list[Individual]) -> list[Individual]:
        """Return the best of different designs, best first."""
        return sorted(candidates, key=lambda individual: individual.fitness.values)[: self.maxsize]

    def _improved(self, before: Sequence[tuple[tuple[float, ...], tuple[float, ...]]]) -> bool:
        """Return whether the hall improved. before : points and costs of its designs until now."""
        return bool(self.items) and (not before or self.items[0].fitness.values < before[0][1])


class ParetoFront(HallOfFame, tools.ParetoFront):
    """DEAP's hall of fame for several objectives: the whole front, sorted by its first cost."""

    def __init__(self) -> None:
        super().__init__(None)

    def _chosen(self, candidates: list[Individual]) -> list[Individual]:
        if not candidates:
            return []
        front = tools.sortNondominated(candidates, len(candidates), first_front_only=True)[0]
        return sorted(front, key=lambda individual: individual.fitness.values)

    def _improved(self, before: Sequence[tuple[tuple[float, ...], tuple[float, ...]]]) -> bool:
        points = {point for point, _ in before}
        return any(tuple(individual) not in points for individual in self.items)


def hall_of_fame(problem: Problem, size: int) -> HallOfFame:
    """Return the empty hall of fame of a problem. size : largest length of a ranking; a front is kept
    whole."""
    return ParetoFront() if problem.several else HallOfFame(size)


def reported(individual: Individual) -> tuple[float, ...]:
    """Return the reported costs of a design: from held-out starts, if it has any."""
    return tuple(one.mean for one in individual.confirmed) or tuple(individual.fitness.values)


def not_dominated(front: Sequence[Individual]) -> list[Individual]:
    """Return the designs of a front that no other dominates, sorted by the first cost; costs as reported."""
    costs = np.array([reported(individual) for individual in front])
    no_better = np.all(costs[:, None] >= costs[None], axis=2)
    worse = np.any(costs[:, None] > costs[None], axis=2)
    dominated = (no_better & worse).any(axis=1)
    kept = [individual for individual, out in zip(front, dominated, strict=True) if not out]
    return sorted(kept, key=reported)


def compromise(front: Sequence[Individual]) -> Individual:
    """Return the design of a front nearest to the best of each objective, the front's ranges scaled to 1."""
    costs = np.array([reported(individual) for individual in front])
    span = np.ptp(costs, axis=0)
    distance = np.linalg.norm((costs - costs.min(axis=0)) / np.where(span > 0, span, 1.0), axis=1)
    return front[int(np.argmin(distance))]
