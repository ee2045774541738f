"""Breeding of a generation from the one before, Z04 sections 7 and 8, with DEAP's toolbox."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
from deap import base, tools

from tisim.optimize.methods.breeding_settings import Breeding
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import SearchBox


class Breeder:
    """Makes generations. It has its own random numbers: no global state is read or changed.

    box : the current search box, in the unit cube.
    """

    def __init__(self, genes: int, settings: Breeding, seed: int) -> None:
        self.settings = settings
        self.box = SearchBox.full(genes)
        self._rng = np.random.default_rng(np.random.SeedSequence([seed, 0]))
        self.toolbox = base.Toolbox()
        self.toolbox.register("clone", copy.deepcopy)
        self.toolbox.register("select", tools.selBest)
        self.toolbox.register("mate", mate_z04, rng=self._rng)

    def first(self) -> list[Individual]:
        """Return a population of random individuals (Z04 step 1)."""
        return self._fresh(self.settings.population)

    def next_generation(self, population: Sequence[Individual]) -> list[Individual]:
        """Return the best individuals (with a valid fitness), their offspring and fresh ones (Z04 3 to 6)."""
        best = self.toolbox.select(population, self.settings.parents)
        offspring = self._offspring(population, self.settings.bred)
        fresh = self._fresh(self.settings.population - len(best) - len(offspring))
        return [*best, *offspring, *fresh]

    def recentre(self, best: Individual) -> None:
        """Shrink the search box around the best individual (Z04 section 8)."""
        self.box = self.box.recentre(np.array(best), self.settings.recentre_factor)

    def _fresh(self, count: int) -> list[Individual]:
        return [Individual(self.box.sample(self._rng)) for _ in range(count)]

    def _offspring(self, population: Sequence[Individual], count: int) -> list[Individual]:
        mated = [self.toolbox.clone(individual) for individual in self.toolbox.select(population, count)]
        pairs = zip(mated[::2], mated[1::2], strict=True)
        return [Individual(child) for pair in pairs for child in self.toolbox.mate(*pair)]


def mate_z04(
    first: Sequence[float], second: Sequence[float], rng: np.random.Generator
) -> tuple[Individual, Individual]:
    """Return two offspring, as in Z04 step 4.

        phi A + (1 - phi) B

    A new weight 0 <= phi <= 1 is drawn for every component of both. first, second : shape (genes,). Each
    component of an offspring lies between the parents' components.
    """
    a, b = np.array(first), np.array(second)
    phi = rng.random((2, len(a)))
    # Rounding must not carry a component past a parent, or out of the unit cube.
    one, two = np.clip(phi * a + (1 - phi) * b, np.minimum(a, b), np.maximum(a, b))
    return Individual(one), Individual(two)
