"""A genetic algorithm of DEAP's operators, with or without a surrogate that selects the designs to run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from deap import tools
from pydantic import Field, model_validator

from tisim.components.component import Checked
from tisim.errors import must
from tisim.optimize.methods.base import SearchMethod
from tisim.optimize.methods.gaussian_process import missing, sobol
from tisim.optimize.methods.individual import Individual
from tisim.optimize.methods.operators import GeneticOperator, Operators, registered
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.acquisition import Worth
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.gaussian_process import Array
from tisim.optimize.surrogate.trust_region import SAME_PLACE, TrustRegion

_GROWTH = 20
"""A generation has at least 1 / this of the number of known designs, to limit the share of time for refitting
the surrogate."""
_PARENTS = 20
"""Parents of a generation with a surrogate, for each objective."""
_MOST_BRED = 2000
"""Largest number of individuals bred on the surrogate in an inner generation, unless more are run."""
_TRIES = 10
"""Number of times that a generation is bred again if it contains known designs."""
SELECT = GeneticOperator(name="selTournament", options={"tournsize": 2})
SELECT_SEVERAL = GeneticOperator(name="selTournamentDCD")


class BreedingOptions(Checked):
    """The settings of a genetic algorithm.

    population : designs in a generation (None: 8 with a surrogate; without one 20, or 40 for several
        objectives).
    select, mate, mutate : operators of deap.tools by name, with their options, or functions with the same
        signature. select None: tournaments of two, by rank and crowding for several objectives. mutate None:
        polynomial, of each gene with probability 1/2 with a surrogate and 1/genes without. ``toolbox``, a
        deap.base.Toolbox, may be given in place of the operators that it has.
    crossover_probability : probability that a pair is mated.
    mutation_probability : probability that an individual is then mutated.
    """

    population: int | None = Field(None, ge=1)
    select: GeneticOperator | None = None
    mate: GeneticOperator = GeneticOperator(name="cxSimulatedBinaryBounded", options={"eta": 15.0})
    mutate: GeneticOperator | None = None
    crossover_probability: float = Field(0.9, ge=0, le=1)
    mutation_probability: float = Field(1.0, ge=0, le=1)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.options.population=60``."""
        return "search.options"

    @model_validator(mode="before")
    @classmethod
    def _of_a_toolbox(cls, data: Any) -> Any:
        """Return the settings with the operators of a toolbox in place of it."""
        if not isinstance(data, Mapping) or "toolbox" not in data:
            return data
        given = {name: value for name, value in data.items() if name != "toolbox"}
        found = registered(data["toolbox"])
        for role in found:
            must(
                role not in given, f"search.options.{role}", "left out if the toolbox has it", given.get(role)
            )
        return given | found


class GeneticOptions(BreedingOptions):
    """The settings of a surrogate-assisted genetic algorithm.

    surrogate : whether a surrogate is used.
    first : designs of generation 0 (None: twice the number of genes, at least 10).
    proposals : individuals bred on the surrogate for each one that is run, in each of ``inner`` generations.
    """

    surrogate: bool = True
    first: int | None = Field(None, ge=2)
    proposals: int = Field(30, ge=1)
    inner: int = Field(5, ge=1)

    @model_validator(mode="after")
    def _only_with_a_surrogate(self) -> GeneticOptions:
        if not self.surrogate:
            for name in ("first", "proposals", "inner"):
                value = getattr(self, name)
                unused = value == type(self).model_fields[name].get_default()
                must(unused, f"search.options.{name}", "left out if surrogate is false", value)
        return self


class Genetic(SearchMethod):
    """A genetic algorithm built from DEAP operators, for one objective or several.

    Without a surrogate, the parents are the best designs so far (selBest), or the selection of NSGA-II, and a
    generation consists of their offspring. With a surrogate, parents are selected by posterior mean and a
    population evolves on the surrogate for some generations; of all individuals bred there, the ones with the
    greatest joint worth are run. With one objective without noise, half of the designs come from a trust
    region, as in gaussian_process.py.

    Source: Y. Jin, Swarm Evol. Comput. 1 (2011) 61-70, reviews such algorithms.
    """

    name = "genetic"
    several = True
    takes_experiments = True
    Options: ClassVar[type[Checked]] = GeneticOptions

    def __init__(self, genome: Genome, objectives: int, options: GeneticOptions, seed: int) -> None:
        self.options, self.genome, self.objectives = options, genome, objectives
        self.genes = len(genome)
        self.rng = np.random.default_rng(np.random.SeedSequence([seed, 2]))
        usual = SELECT if objectives == 1 else SELECT_SEVERAL
        share = 0.5 if options.surrogate else 1.0 / self.genes
        mutate = GeneticOperator(name="mutPolynomialBounded", options={"eta": 20.0, "indpb": share})
        self.operators = Operators(
            {"select": options.select or usual, "mate": options.mate, "mutate": options.mutate or mutate},
            self.genes,
            objectives,
            (options.crossover_probability, options.mutation_probability),
            seed,
        )
        plain = 20 if objectives == 1 else 40
        self.population = options.population or (8 if options.surrogate else plain)
        self.individuals: list[Individual] = []
        self.known: set[tuple[float, ...]] = set()
        self.parents: list[Individual] = []
        self.belief, self.region = Belief(genome.features), TrustRegion(genome)
        self.local: int | None = None
        self.begun = False

    @classmethod
    def starts_of_its_own(cls, options: BreedingOptions) -> bool:
        return isinstance(options, GeneticOptions) and options.surrogate

    def ask(self) -> list[Individual]:
        usual = self.population
        if self.options.surrogate:
            usual = self.options.first or max(10, 2 * self.genes)
        first = missing(usual, sum(not individual.failed for individual in self.individuals), self.begun)
        self.begun = True
        if first:
            points = self._first(first)
        elif self.options.surrogate:
            points = self._worth_most()
        else:
            points = self._offspring()
        return self._individuals_at(points)

    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        self.learn(population)
        if self.local is not None:
            self.region.learn(population[: self.local])
            self.local = None

    def learn(self, individuals: Sequence[Individual]) -> None:
        new = [individual for individual in individuals if tuple(individual) not in self.known]
        self.known |= {tuple(individual) for individual in new}
        if self.options.surrogate:
            self.individuals += new
        else:
            # A design that is not among the best now never will be.
            good = [individual for individual in [*self.individuals, *new] if not individual.failed]
            self.individuals = self._best(good, self.population)

    def _first(self, count: int) -> Array:
        if self.options.surrogate:
            points = sobol(self.genes, count, self.rng)
        else:
            points = self.rng.random((count, self.genes))
        return self.genome.canonical(points)

    def _offspring(self) -> Array:
        """Return new designs bred from the best; random ones if breeding gives none."""
        bred = np.empty((0, self.genes))
        for _ in range(_TRIES):
            more = self.genome.canonical(self.operators.bred(self.individuals, self.population))
            bred = self._new(np.vstack([bred, more]))
            if len(bred) >= self.population:
                return bred[: self.population]
        drawn = self.genome.canonical(self.rng.random((_TRIES * self.population, self.genes)))
        return self._new(np.vstack([bred, drawn]))[: self.population]

    def _worth_most(self) -> Array:
        """Return the designs with the greatest joint worth according to the surrogate."""
        count = max(self.population, len(self.individuals) // _GROWTH)
        self.belief.learn(self.individuals, apart=SAME_PLACE)
        local = np.empty((0, self.genes))
        if self.belief.exact and self.objectives == 1:
            proposed = self.region.propose(self.belief, (count + 1) // 2, self.rng)
            local = self._new(self.genome.canonical(proposed))
            self.local = len(local)
        worth = Worth(self.belief, self.rng)
        bred = max(count, min(_MOST_BRED, count * self.options.proposals))
        evolved = self._new(self._evolved(worth, bred))
        return np.vstack([local, worth.batch(evolved, count - len(local))])

    def _evolved(self, worth: Worth, count: int) -> Array:
        """Return the individuals of some generations on the surrogate, ``count`` in each.

        The first generation also has ``count`` random individuals. The fitness is the worth of a run for one
        cost, and the posterior means for several.
        """
        belief, most = self.belief, _PARENTS * self.objectives
        parents = self._best(self._individuals_at(belief.points[belief.chosen], belief.means), most)
        drawn = [self._open(self.rng.random((count, self.genes)))]
        for _ in range(self.options.inner):
            drawn.append(self._open(self.operators.bred(parents, count)))
            points = drawn[-1] if len(drawn) > 2 else np.vstack(drawn)
            means, deviations = belief.predict(points)
            log_valid = belief.log_valid(points)
            costs = means if log_valid is None else self._expected(means, np.exp(log_valid))
            if self.objectives == 1:
                costs = -worth(means, deviations, log_valid)[:, None]
            kept = parents if len(drawn) > 2 else []
            parents = self._best(self._individuals_at(points, costs) + kept, most)
        return np.vstack(drawn)

    def _expected(self, means: Array, valid: Array) -> Array:
        """Return the expected costs of designs that are valid with these probabilities, (m,), if a failed
        design has the worst cost."""
        worst = self.belief.costs.max(axis=0)
        return worst + valid[:, None] * (means - worst)

    def _open(self, points: Array) -> Array:
        """Return the points outside the trust region, if there is one."""
        points = self.genome.canonical(points)
        return points if self.local is None else points[self.region.outside(points)]

    def _best(self, individuals: list[Individual], most: int) -> list[Individual]:
        """Return the individuals selected as parents, at most ``most`` of these."""
        if not individuals:
            return []
        if self.objectives == 1:
            return list(tools.selBest(individuals, most))
        return list(tools.selNSGA2(individuals, most, nd="log"))

    def _individuals_at(self, points: Array, costs: Array | None = None) -> list[Individual]:
        """Return individuals, with costs if given."""
        individuals = [Individual(point, self.objectives) for point in points]
        for individual, values in zip(individuals, () if costs is None else costs, strict=False):
            individual.fitness.values = tuple(map(float, values))
        return individuals

    def _new(self, points: Array) -> Array:
        """Return the points that are not known, each once, in order."""
        rows = dict.fromkeys(map(tuple, points.tolist()))
        return np.array([row for row in rows if row not in self.known]).reshape(-1, self.genes)
