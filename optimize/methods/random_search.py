"""Random search: the baseline for all other methods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field

from tisim.components.component import Checked
from tisim.optimize.methods.base import SearchMethod
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome


class RandomSearchOptions(Checked):
    """The settings of random search.

    population : individuals in a generation.
    """

    population: int = Field(20, ge=1)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.options.population=30``."""
        return "search.options"


class RandomSearch(SearchMethod):
    """Draws designs uniformly from the whole range, independent of earlier results."""

    name = "random"
    several = True
    Options = RandomSearchOptions

    def __init__(self, genome: Genome, objectives: int, options: RandomSearchOptions, seed: int) -> None:
        self.shape, self.objectives = (options.population, len(genome)), objectives
        self.rng = np.random.default_rng(np.random.SeedSequence([seed, 3]))

    def ask(self) -> list[Individual]:
        return [Individual(point, self.objectives) for point in self.rng.random(self.shape)]

    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        """Do nothing: random search does not learn."""
