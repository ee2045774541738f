"""CMA-ES: DEAP's evolution strategy with covariance matrix adaptation, on genes scaled to the unit cube."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from deap import cma
from numpy.typing import NDArray
from pydantic import Field

from tisim.components.component import Checked
from tisim.optimize.methods.base import SearchMethod
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome

EDGE = 0.05
"""Distance from a bound within which the mapping is bent, as a fraction of the range."""


class CmaOptions(Checked):
    """The settings of CMA-ES.

    population : individuals in a generation (None: 4 + 3 ln(genes)).
    sigma : initial standard deviation, as a fraction of the search range.
    smallest : the search has converged, and restarts elsewhere, when the standard deviation along the widest
        axis falls below this.
    """

    population: int | None = Field(None, ge=4)
    sigma: float = Field(0.3, gt=0, le=1)
    smallest: float = Field(1e-4, gt=0, lt=1)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.options.sigma=0.2``."""
        return "search.options"


class CmaEs(SearchMethod):
    """CMA-ES, as implemented in deap.cma.Strategy, with restarts.

    It starts at the centre of the range, or at the best known design. The strategy searches an unbounded
    space, which ``within`` maps to the genes. After convergence it restarts from a random centre with twice
    the population.

    Source: N. Hansen and A. Ostermeier, Evol. Comput. 9 (2001) 159-195; restarts: A. Auger and N. Hansen,
    IEEE CEC (2005) 1769-1776.
    """

    name = "cma-es"
    takes_experiments = True
    Options = CmaOptions

    def __init__(self, genome: Genome, objectives: int, options: CmaOptions, seed: int) -> None:
        self.options = options
        self.rng = np.random.default_rng(np.random.SeedSequence([seed, 1]))
        sizes = {} if options.population is None else {"lambda_": options.population}
        self.strategy = cma.Strategy(np.full(len(genome), 0.5), options.sigma, **sizes)
        self.asked: dict[tuple[float, ...], NDArray[np.float64]] = {}
        self.start: Individual | None = None
        self.begun = False

    @property
    def width(self) -> float:  # type: ignore[override]
        """The width of the interval of +- one standard deviation, the mean over genes; 1 at most."""
        spread = 2 * self.strategy.sigma * np.sqrt(np.diag(self.strategy.C))
        return float(np.minimum(spread, 1.0).mean())

    def ask(self) -> list[Individual]:
        now, self.begun = self.strategy, True
        normal = self.rng.standard_normal((now.lambda_, now.dim))
        points = folded(now.centroid + now.sigma * normal @ now.BD.T)
        individuals = [Individual(point) for point in within(points)]
        self.asked = {tuple(individual): point for individual, point in zip(individuals, points, strict=True)}
        return individuals

    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        self.moved = False
        if all(individual.failed for individual in population):
            return  # ranks of failures only would mislead the strategy; the next individuals are others
        self.strategy.update([self._as_drawn(individual) for individual in population])
        now = self.strategy
        if now.sigma * now.diagD[-1] < self.options.smallest or not now.diagD[0] > 0:
            middle = self.rng.random(now.dim)
            self.strategy = cma.Strategy(middle, self.options.sigma, lambda_=2 * now.lambda_)
            self.moved = True

    def learn(self, individuals: Sequence[Individual]) -> None:
        known = [one for one in (self.start, *individuals) if one is not None and not one.failed]
        if known and not self.begun:
            self.start = min(known, key=lambda individual: individual.fitness.values)
            self.strategy.centroid = drawn_of(np.array(self.start))

    def _as_drawn(self, individual: Individual) -> Individual:
        """Return an individual at the position that the strategy drew, with its fitness."""
        drawn = Individual(self.asked.get(tuple(individual), individual))
        drawn.fitness = individual.fitness
        return drawn


def within(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points of [-EDGE, 1 + EDGE] mapped to [0, 1].

    The mapping is the identity except within EDGE of a bound; there a parabola leads smoothly to the bound. A
    best design on a bound is then a smooth minimum of the strategy.

    Source: the transformation BoundTransform of N. Hansen's program cma.
    """
    low, high = points < EDGE, points > 1 - EDGE
    inside = np.where(low, (points + EDGE) ** 2 / (4 * EDGE), points)
    return np.clip(np.where(high, 1 - (1 + EDGE - points) ** 2 / (4 * EDGE), inside), 0.0, 1.0)


def drawn_of(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points of [-EDGE, 1 + EDGE] that ``within`` maps to these."""
    low, high = 2 * np.sqrt(EDGE * points) - EDGE, 1 + EDGE - 2 * np.sqrt(EDGE * (1 - points))
    return np.where(points < EDGE, low, np.where(points > 1 - EDGE, high, points))


def folded(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points, shape (individuals, genes), with values outside [-EDGE, 1 + EDGE] reflected at its ends,
    at which the transformation is level."""
    width = 1 + 2 * EDGE
    return width - np.abs(width - np.mod(points + EDGE, 2 * width)) - EDGE
