"""Bayesian optimisation: a Gaussian process of the designs that were run proposes the next ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field
from scipy.stats import qmc

from tisim.components.component import Checked
from tisim.optimize.methods.base import SearchMethod
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.acquisition import Worth
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.gaussian_process import Array
from tisim.optimize.surrogate.trust_region import SAME_PLACE, TrustRegion

_ROUNDS, _DRAWN = 6, 200
"""Number of rounds in which the best candidates are varied, and number of variations in each."""
_WIDE = 0.2
"""Largest standard deviation of a variation, as a fraction of a gene's range."""
_GROWTH = 20
"""A batch has at least 1 / this of the number of known designs, to limit the share of time for refitting the
process."""


class GaussianProcessOptions(Checked):
    """The settings of Bayesian optimisation.

    population : designs in a generation; more once about a hundred are known.
    first : designs of generation 0 (None: twice the number of genes, at least 10).
    """

    population: int = Field(8, ge=1)
    first: int | None = Field(None, ge=2)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.options.population=4``."""
        return "search.options"


class GaussianProcessSearch(SearchMethod):
    """Bayesian optimisation with a Gaussian process of known noise; see optimize.surrogate.

    Generation 0 is a scrambled Sobol' sequence, shorter if some designs are already known. Then each batch is
    chosen by expected improvement, or by hypervolume for several objectives, from candidates over the whole
    range and around the best designs. With one objective without noise, half of the batch comes from a trust
    region around the best design, which grows on success and shrinks on failure.

    Source: trust region: D. Eriksson and others, NeurIPS 32 (2019).
    """

    name = "gaussian-process"
    several = True
    own_starts = True
    takes_experiments = True
    Options = GaussianProcessOptions

    def __init__(self, genome: Genome, objectives: int, options: GaussianProcessOptions, seed: int) -> None:
        self.options, self.genome, self.objectives = options, genome, objectives
        self.genes = len(genome)
        self.rng = np.random.default_rng(np.random.SeedSequence([seed, 5]))
        self.belief = Belief(genome.features)
        self.region = TrustRegion(genome)
        self.individuals: list[Individual] = []
        self.local: int | None = None
        self.begun = False

    def ask(self) -> list[Individual]:
        known = sum(not individual.failed for individual in self.individuals)
        first = missing(self.options.first or max(10, 2 * self.genes), known, self.begun)
        self.begun = True
        if first:
            points = sobol(self.genes, first, self.rng)
            return [Individual(point, self.objectives) for point in self.genome.canonical(points)]
        count = max(self.options.population, len(self.individuals) // _GROWTH)
        self.belief.learn(self.individuals, apart=SAME_PLACE)
        local, self.local = np.empty((0, self.genes)), None
        if self.belief.exact and self.objectives == 1:
            proposed = self.region.propose(self.belief, (count + 1) // 2, self.rng)
            local = self._new(self.genome.canonical(proposed))
            self.local = len(local)
        worth = Worth(self.belief, self.rng)
        everywhere = worth.batch(self._candidates(worth), count - len(local))
        return [Individual(point, self.objectives) for point in np.vstack([local, everywhere])]

    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        self.learn(population)
        if self.local:
            self.region.learn(population[: self.local])

    def learn(self, individuals: Sequence[Individual]) -> None:
        known = {tuple(individual) for individual in self.individuals}
        self.individuals += [individual for individual in individuals if tuple(individual) not in known]

    def _candidates(self, worth: Worth) -> Array:
        """Return candidates over the whole range and around the best designs, and variations of the best
        candidates."""
        belief = self.belief
        order = belief.chosen[np.argsort(belief.means[:, 0], kind="stable")]
        best = belief.points[order[:5] if self.objectives == 1 else worth.on_front]
        drawn = [self.rng.random((3 * _DRAWN, self.genes)), changed(best, _WIDE, 2 * _DRAWN, self.rng)]
        drawn = [self._open(points) for points in drawn]
        values = [worth.of(points) for points in drawn]
        for turn in range(_ROUNDS):
            order = np.argsort(-np.concatenate(values))[: 12 * self.objectives]
            points = self._open(changed(np.vstack(drawn)[order], 0.6**turn * _WIDE, _DRAWN, self.rng))
            drawn.append(points)
            values.append(worth.of(points))
        return self._new(self.genome.canonical(np.vstack(drawn)))

    def _open(self, points: Array) -> Array:
        """Return the points outside the trust region, if there is one."""
        return points if self.local is None else points[self.region.outside(points)]

    def _new(self, points: Array) -> Array:
        """Return the points that have not run, each once, in order."""
        known = {tuple(individual) for individual in self.individuals}
        rows = dict.fromkeys(map(tuple, points.tolist()))
        return np.array([row for row in rows if row not in known]).reshape(-1, self.genes)


def missing(first: int, known: int, begun: bool) -> int:
    """Return the number of random designs still needed before a surrogate is fitted.

    When a search begins, known designs reduce this number. The full number is drawn again while hardly any
    design has succeeded.
    """
    if known < 2:
        return first
    return 0 if begun else max(0, first - known)


def sobol(genes: int, count: int, rng: np.random.Generator) -> Array:
    """Return the first points of a scrambled Sobol' sequence, (count, genes)."""
    whole = qmc.Sobol(genes, rng=rng).random_base2(max(count - 1, 1).bit_length())
    return np.asarray(whole[:count])


def changed(points: Array, widest: float, count: int, rng: np.random.Generator) -> Array:
    """Return variations of points of the unit cube, (count, genes), that differ in at least one gene.

    The changes are normal, with standard deviations of ``widest`` or less, on a logarithmic scale.
    """
    genes = points.shape[1]
    base = points[rng.integers(len(points), size=count)]
    which = rng.random((count, genes)) < max(0.3, 2.0 / genes)
    which[np.arange(count), rng.integers(genes, size=count)] = True
    width = widest * 10.0 ** rng.uniform(-1.5, 0.0, (count, 1))
    return np.clip(base + width * rng.standard_normal((count, genes)) * which, 0.0, 1.0)
