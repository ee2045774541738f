"""How a generation of strings follows from the one before: DEAP toolbox operators, Z04's or DEAP's own."""

from __future__ import annotations

import copy
import random
from collections.abc import Mapping, Sequence

import numpy as np
from deap import base, tools

from optimize.methods.breeding_settings import Breeding
from optimize.methods.individual import Individual
from optimize.methods.random_state import OwnRandom
from optimize.problem.genome import SearchBox
from tisim import InputError
from tisim.errors import must


class Breeder:
    """Makes generations. Its random numbers are its own: nothing global is read or left changed.

    box : the current search box, in the unit cube.
    """

    def __init__(self, genes: int, settings: Breeding, seed: int) -> None:
        self.settings = settings
        self.box = SearchBox.full(genes)
        self._rng = np.random.default_rng(np.random.SeedSequence([seed, 0]))
        self.random = OwnRandom(seed)
        self.toolbox = base.Toolbox()
        self.toolbox.register("clone", copy.deepcopy)
        if settings.breeding == "z04":
            self.toolbox.register("select", tools.selBest)
            self.toolbox.register("mate", mate_z04, rng=self._rng)
        else:
            for name, prefix in (("select", "sel"), ("mate", "cx"), ("mutate", "mut")):
                function, options = getattr(settings, name).bound(prefix)
                self.toolbox.register(name, function, **options)
            self._rehearse(genes)

    def first(self) -> list[Individual]:
        """Return, as Z04 step 1, a population of random strings."""
        return self._fresh(self.settings.population)

    def next_generation(self, population: Sequence[Individual]) -> list[Individual]:
        """Return the best strings (with a valid fitness), their offspring and fresh ones (Z04 3 to 6)."""
        best = tools.selBest(population, self.settings.parents)
        offspring = self._offspring(population, self.settings.bred)
        fresh = self._fresh(self.settings.population - len(best) - len(offspring))
        return [*best, *offspring, *fresh]

    def recentre(self, best: Individual) -> None:
        """Shrink the search box around the best string (Z04 section 8)."""
        self.box = self.box.recentre(np.array(best), self.settings.recentre_factor)

    def _fresh(self, count: int) -> list[Individual]:
        return [Individual(self.box.sample(self._rng)) for _ in range(count)]

    def _offspring(self, population: Sequence[Individual], count: int) -> list[Individual]:
        if self.settings.breeding == "z04":
            mated = [self.toolbox.clone(string) for string in self.toolbox.select(population, count)]
            pairs = zip(mated[::2], mated[1::2], strict=True)
            return [Individual(child) for pair in pairs for child in self.toolbox.mate(*pair)]
        with self.random:
            mated = [self._to_box(string) for string in self.toolbox.select(list(population), count)]
            for i in range(0, count, 2):
                if random.random() < self.settings.crossover_probability:
                    mated[i : i + 2] = self.toolbox.mate(mated[i], mated[i + 1])
            for i in range(count):
                if random.random() < self.settings.mutation_probability:
                    (mated[i],) = self.toolbox.mutate(mated[i])
        return [self._from_box(string) for string in mated]

    def _to_box(self, string: Individual) -> Individual:
        return Individual(np.clip((np.array(string) - self.box.low) / self.box.width, 0, 1))

    def _from_box(self, string: Individual) -> Individual:
        return Individual(
            np.clip(self.box.low + np.array(string) * self.box.width, self.box.low, self.box.high)
        )

    def _rehearse(self, genes: int) -> None:
        """Breed from throwaway strings, one of them failed: an unfit operator must show before any run."""
        rng, state = np.random.default_rng(0), self.random.state
        strings = [Individual(rng.random(genes)) for _ in range(self.settings.population)]
        for rank, string in enumerate(strings):
            string.fitness.values = (float(rank) if rank else float("inf"),)
        try:
            bred = self._offspring(strings, self.settings.bred)
            with self.random:
                for string in strings:
                    bred += self.toolbox.mate(Individual(string), Individual(strings[0]))
                    bred += self.toolbox.mutate(Individual(string))
            good = all(len(string) == genes and np.all(np.isfinite(string)) for string in bred)
        except Exception as error:
            raise InputError(
                f"operators must be fit for real-valued strings; received {self._names()} ({error!r})"
            ) from error
        finally:
            self.random.state = state
        must(good, "operators", "fit for real-valued strings", self._names())

    def _names(self) -> Mapping[str, str]:
        return {kind: getattr(self.settings, kind).name for kind in ("select", "mate", "mutate")}


def mate_z04(
    first: Sequence[float], second: Sequence[float], rng: np.random.Generator
) -> tuple[Individual, Individual]:
    """Return two offspring, as in Z04 step 4: phi A + (1 - phi) B.

    A fresh weight 0 <= phi <= 1 for every component of both. first, second : shape (genes,).
    Each component of an offspring lies between its parents'.
    """
    a, b = np.array(first), np.array(second)
    phi = rng.random((2, len(a)))
    # rounding must not carry a component past a parent, or out of the unit cube
    one, two = np.clip(phi * a + (1 - phi) * b, np.minimum(a, b), np.maximum(a, b))
    return Individual(one), Individual(two)
