"""A trust region around the best design, with its own Gaussian process.

This local process converges, while the process of the whole range, which must fit everywhere, does not. After
convergence the region restarts elsewhere.

Source: D. Eriksson and others, NeurIPS 32 (2019).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.acquisition import Worth
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.gaussian_process import Array

_FIRST, _LARGEST, _SMALLEST = 0.2, 0.4, 1e-3
"""Half-widths of the region in the unit cube: initial, largest, and at convergence."""
SAME_PLACE = 0.02
"""Smallest distance, in at least one gene, between the designs that the process of the whole range is fitted
to."""
_APART = 0.1
"""The process of the whole range proposes only designs farther from the centre than this in at least one
gene."""
_ROUNDS, _DRAWN, _BEST = 6, 200, 12


class TrustRegion:
    """A trust region for one cost without noise.

    centre : the best design; after a restart, the best design of the current region, which begins with random
        designs.
    half_width : half-width of the region around it.
    own : the designs of a restarted region; None before the first restart.
    """

    def __init__(self, genome: Genome) -> None:
        self.genome, self.genes = genome, len(genome)
        self.half_width = _FIRST
        self.own: list[Individual] | None = None
        self.centre = np.full(self.genes, 0.5)
        self.cost = np.inf
        self.belief = Belief(self._within)

    def propose(self, belief: Belief, count: int, rng: np.random.Generator) -> Array:
        """Return the most worthwhile designs in the region, (count, genes)."""
        individuals = belief.individuals if self.own is None else self.own
        best = min(
            (one for one in individuals if not one.failed), key=lambda one: one.fitness.values, default=None
        )
        if best is None:
            self.cost = np.inf
            return rng.random((count, self.genes))
        self.centre, self.cost = np.array(best), float(best.fitness.values[0])
        # The number of coefficients of a quadratic function, and some more.
        enough = max(40, min(200, (self.genes + 1) * (self.genes + 2)))
        nearest = np.argsort(((belief.points - self.centre) ** 2).sum(axis=1), kind="stable")[:enough]
        self.belief.learn([belief.individuals[i] for i in nearest])
        self.belief.validity = belief.validity
        worth = Worth(self.belief, rng)
        worth.best = self.belief.costs[0]  # the centre; designs elsewhere may be better
        low = np.maximum(self.centre - self.half_width, 0.0)
        high = np.minimum(self.centre + self.half_width, 1.0)
        drawn = [low + rng.random((_DRAWN, self.genes)) * (high - low), self.centre[None]]
        values = [worth.of(points) for points in drawn]
        for turn in range(_ROUNDS):
            order = np.argsort(-np.concatenate(values))[:_BEST]
            best_points = np.vstack(drawn)[order]
            width = self.half_width * 0.6**turn * 10.0 ** rng.uniform(-1.5, 0.0, (_DRAWN, 1))
            base = best_points[rng.integers(len(best_points), size=_DRAWN)]
            drawn.append(np.clip(base + 0.5 * width * rng.standard_normal(base.shape), low, high))
            values.append(worth.of(drawn[-1]))
        return worth.batch(np.vstack(drawn), count, apart=1e-3 * self.half_width)

    def outside(self, points: Array) -> NDArray[np.bool_]:
        """Return which points are away from the centre.

        The region itself searches around the centre. Without this rule, the process of the whole range would
        often propose designs there too, with little left to find.
        """
        return np.abs(points - self.centre).max(axis=1) > _APART

    def learn(self, proposed: Sequence[Individual]) -> None:
        """Update the size of the region from the costs of the designs that it proposed."""
        good = [individual for individual in proposed if individual.fitness.valid and not individual.failed]
        if self.own is not None:
            self.own += good
            if np.isinf(self.cost):
                return
        best = min(good, key=lambda individual: individual.fitness.values, default=None)
        if best is None or best.fitness.values[0] >= self.cost:
            self.half_width *= 0.5
        else:
            moved = float(np.abs(np.array(best) - self.centre).max())
            grown = 2.0 * self.half_width if moved > 0.5 * self.half_width else 0.7 * self.half_width
            self.half_width = min(_LARGEST, max(grown, 2.0 * moved))
        if self.half_width < _SMALLEST:
            self.half_width, self.own = _FIRST, []

    def _within(self, points: Array) -> Array:
        return (self.genome.features(points) - self.genome.features(self.centre)) / self.half_width
