"""NSGA-II: a genetic algorithm that pushes a whole front forward and keeps it spread out."""

from __future__ import annotations

import copy
import random
from collections.abc import Sequence

import numpy as np
from deap import tools
from pydantic import Field, model_validator

from optimize.methods.base import SearchMethod
from optimize.methods.individual import Individual
from optimize.methods.random_state import OwnRandom
from optimize.problem.genome import Genome
from tisim.components.component import Checked
from tisim.errors import must


class Nsga2Options(Checked):
    """The settings of NSGA-II.

    population : strings per generation, a multiple of 4. crossover : probability that a pair is mated;
    mutation : that a gene is changed (None: 1/genes). eta : distribution index of both; the larger, the
    nearer are children to their parents. Defaults are those of the paper, the population's excepted.
    """

    population: int = Field(40, ge=4)
    crossover: float = Field(0.9, ge=0, le=1)
    mutation: float | None = Field(None, ge=0, le=1)
    eta: float = Field(20.0, gt=0)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.options.population=60``."""
        return "search.options"

    @model_validator(mode="after")
    def _in_fours(self) -> Nsga2Options:
        must(self.population % 4 == 0, "population of nsga2", "a multiple of 4", self.population)
        return self


class Nsga2(SearchMethod):
    """K. Deb, A. Pratap, S. Agarwal and T. Meyarivan, IEEE Trans. Evol. Comput. 6 (2002) 182-197."""

    name = "nsga2"
    several = True
    Options = Nsga2Options

    def __init__(self, genome: Genome, objectives: int, options: Nsga2Options, seed: int) -> None:
        self.options, self.genes, self.objectives = options, len(genome), objectives
        self.rng = np.random.default_rng(np.random.SeedSequence([seed, 2]))
        self.random = OwnRandom(seed)
        self.parents: list[Individual] = []

    def ask(self) -> list[Individual]:
        if not self.parents:
            points = self.rng.random((self.options.population, self.genes))
            return [Individual(point, self.objectives) for point in points]
        return self._offspring()

    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        everyone = [*self.parents, *population]
        good = [string for string in everyone if not string.failed]
        failed = [string for string in everyone if string.failed]
        for string in failed:
            string.fitness.crowding_dist = 0.0
        self.parents = (tools.selNSGA2(good, self.options.population) if good else []) + failed
        del self.parents[self.options.population :]

    def _offspring(self) -> list[Individual]:
        options = self.options
        mutation = 1 / self.genes if options.mutation is None else options.mutation
        with self.random:
            parents = tools.selTournamentDCD(self.parents, options.population)
            children = [copy.deepcopy(list(string)) for string in parents]
            for one, two in zip(children[::2], children[1::2], strict=True):
                if random.random() < options.crossover:
                    tools.cxSimulatedBinaryBounded(one, two, options.eta, 0.0, 1.0)
                for child in (one, two):
                    tools.mutPolynomialBounded(child, options.eta, 0.0, 1.0, mutation)
        return [Individual(np.clip(child, 0.0, 1.0), self.objectives) for child in children]
