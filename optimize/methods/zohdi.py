"""The genetic algorithm of Z04: T. I. Zohdi, Proc. R. Soc. Lond. A 460 (2004) 3421-3445."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from deap import tools

from tisim.optimize.methods.base import SearchMethod
from tisim.optimize.methods.breeding import Breeder
from tisim.optimize.methods.breeding_settings import Breeding
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome


class Zohdi(SearchMethod):
    """Z04 sections 7 and 8; see optimize.methods.breeding. An individual is Zohdi's genetic string."""

    name = "zohdi"
    Options = Breeding
    ensemble: ClassVar[Mapping[str, Any]] = {"tolerance": 5e-4, "min_starts": 4, "block": 6}
    dependent_options: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "population": ("parents", "offspring"), "parents": ("offspring",), "offspring": ("parents",),
    }  # fmt: skip

    def __init__(self, genome: Genome, objectives: int, options: Breeding, seed: int) -> None:
        self.options, self.breeder = options, Breeder(len(genome), options, seed)
        self.generation = 0
        self.next_population: list[Individual] = []

    @property
    def width(self) -> float:  # type: ignore[override]
        return float(self.breeder.box.width.mean())

    def ask(self) -> list[Individual]:
        return self.next_population or self.breeder.first()

    def learn(self, individuals: Sequence[Individual]) -> None:
        """Replace random individuals by the best of these, at most the number of parents."""
        good = [individual for individual in individuals if not individual.failed]
        best = tools.selBest(good, self.options.parents)
        population = self.next_population or self.breeder.first()
        self.next_population = [*best, *population[: len(population) - len(best)]]

    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        every = self.options.recentre_every
        self.moved = bool(every and self.generation and self.generation % every == 0 and hall)
        if self.moved:
            self.breeder.recentre(hall[0])
        self.generation += 1
        self.next_population = self.breeder.next_generation(population)
