"""Acquisition: selects the designs to run next, those most likely to improve on the known ones.

One cost: the logarithm of the expected improvement on the least posterior mean of the designs that were run.
The logarithm does not underflow. Several costs: the hypervolume that the lower confidence bound of a design
would add to the front. If some designs have failed, either is multiplied by the probability that a design
does not fail.

A batch is chosen one design at a time. Each chosen design is assumed to have its expected mean. This leaves
all means unchanged and reduces the uncertainty of the process around the design (kriging believer).

Source: expected improvement: J. Mockus (1975); D. R. Jones, M. Schonlau and W. J. Welch, J. Global Optim. 13
(1998) 455-492, Eq. 15; its logarithm: S. Ament and others, NeurIPS 36 (2023); hypervolume: W. Ponweiser and
others, PPSN X, LNCS 5199 (2008) 784; kriging believer: D. Ginsbourger, R. Le Riche and L. Carraro (2010).
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtr
from scipy.stats import norm

from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.gaussian_process import Array
from tisim.optimize.surrogate.selection import beaten_by

_CONFIDENCE = 1.0
"""Distance of the confidence bound for several costs from the mean, in standard deviations."""
_LARGEST_IMPROVEMENT = 3.0
"""Largest predicted improvement that counts if values have no noise, in standard deviations. The process then
underestimates its error; among designs that all improve by more than this, the most uncertain one is run."""
_MONTE_CARLO = 4000
"""Number of sample points for a hypervolume of three costs or more."""
_MOST_RANKED = 1500
"""Largest number of candidates for a batch; of more, the best single ones are used."""
_APART = 1e-6
"""Designs of a batch differ by at least this in one gene, as a fraction of its range."""


class Worth:
    """The acquisition function: the worth of running each design, according to a belief.

    rng : random generator for volumes in three dimensions or more, which are sampled.
    """

    def __init__(self, belief: Belief, rng: np.random.Generator) -> None:
        self.belief = belief
        means = belief.means
        self.best = means.min(axis=0)
        self.on_front = belief.chosen[beaten_by(means) == 0]
        self.front = means[beaten_by(means) == 0]
        if means.shape[1] > 1:
            self.volume = _Volume(self.front, rng)

    def __call__(self, means: Array, deviations: Array, log_valid: Array | None = None) -> Array:
        """Return the worth of designs from mean and standard deviation of their costs, both (m, objectives).

        log_valid : logarithm of the probability that they do not fail, (m,); None if all are valid.
        """
        if means.shape[1] == 1:
            mean, deviation, best = means[:, 0], deviations[:, 0], float(self.best[0])
            if self.belief.exact:
                mean = np.maximum(mean, best - _LARGEST_IMPROVEMENT * deviation)
            improvement = log_expected_improvement(mean, deviation, best)
            return improvement if log_valid is None else improvement + log_valid
        added = self.volume.improvement(means - _CONFIDENCE * deviations)
        # A negative value is the distance from the front.
        return added if log_valid is None else added * np.exp(np.where(added > 0, log_valid, -log_valid))

    def of(self, points: Array) -> Array:
        """Return the worth of points of the unit cube, shape (m,)."""
        return self(*self.belief.predict(points), self.belief.log_valid(points))

    def batch(self, points: Array, count: int, apart: float = _APART) -> Array:
        """Return the points with the greatest joint worth, (count, genes), out of many, (m, genes)."""
        belief = self.belief
        means, deviations = belief.predict(points)
        log_valid = belief.log_valid(points)
        if len(points) > _MOST_RANKED:
            # A design of little worth alone has even less in a batch.
            kept = np.argsort(-self(means, deviations, log_valid), kind="stable")[:_MOST_RANKED]
            points, means, deviations = points[kept], means[kept], deviations[kept]
            log_valid = None if log_valid is None else log_valid[kept]
        at = belief.features(points)
        explained = [model.half_solved(at) for model in belief.models]
        rows: list[list[Array]] = [[] for _ in belief.models]
        chosen: list[int] = []
        barred = np.zeros(len(points), dtype=bool)
        for _ in range(min(count, len(points))):
            worth = np.where(barred, -np.inf, self(means, deviations, log_valid))
            pick = int(np.argmax(worth))
            chosen.append(pick)
            barred |= np.abs(points - points[pick]).max(axis=1) < apart
            for k, model in enumerate(belief.models):
                left = (
                    model.covariance(at, at[pick : pick + 1])[:, 0] - explained[k].T @ explained[k][:, pick]
                )
                left = left - sum((row * row[pick] for row in rows[k]), np.zeros(len(points)))
                noise = belief.one_start[k] / belief.starts / model.scale**2 + model.nugget
                row = left / np.sqrt(max(left[pick], 1e-12) + noise)
                rows[k].append(row)
                variance = (deviations[:, k] / model.scale) ** 2 - row**2
                deviations[:, k] = model.scale * np.sqrt(np.maximum(variance, 1e-12))
            if means.shape[1] > 1:
                self.volume.add(means[pick] - _CONFIDENCE * deviations[pick])
        return points[chosen]


def log_expected_improvement(mean: Array, deviation: Array, best: float) -> Array:
    """Return log E[max(best - f, 0)] of normal f, all of one shape."""
    z = (best - mean) / deviation
    # For negative z: phi(z) + z Phi(z) = phi(z) (1 + z Phi(z) / phi(z)), which tends to phi(z) / z^2.
    near, below = np.maximum(z, -1.0), np.minimum(z, -1.0)
    ratio = np.exp(log_ndtr(below) - norm.logpdf(below))
    tail = np.where(below < -30.0, below**-2.0, np.maximum(1.0 + below * ratio, 1e-300))
    logarithm = np.where(
        z > -1.0, np.log(norm.pdf(near) + near * ndtr(near)), norm.logpdf(below) + np.log(tail)
    )
    return logarithm + np.log(deviation)


class _Volume:
    """The hypervolume between a front and a reference point that is worse than all of it.

    It is exact for two costs; for more it is sampled at uniform random points.

    Source: E. Zitzler and L. Thiele, PPSN V, LNCS 1498 (1998) 292-301.
    """

    def __init__(self, front: Array, rng: np.random.Generator) -> None:
        self.low = front.min(axis=0)
        span = np.ptp(front, axis=0)
        self.span = np.where(span > 0, span, 1.0)
        self.reference = front.max(axis=0) + 0.1 * self.span
        self.front = front
        if front.shape[1] > 2:
            low, high = self.low - self.span, self.reference
            self.samples = low + rng.random((_MONTE_CARLO, front.shape[1])) * (high - low)
            self.free = ~np.any(np.all(front[None] <= self.samples[:, None], axis=2), axis=1)

    def add(self, costs: Array) -> None:
        """Add a design with these costs to the front."""
        front = np.vstack([self.front, costs])
        self.front = front[beaten_by(front) == 0]
        if front.shape[1] > 2:
            self.free &= ~np.all(costs <= self.samples, axis=1)

    def improvement(self, costs: Array) -> Array:
        """Return the hypervolume that each of these costs, (m, objectives), would add.

        If a design adds none, the value is negative; it approaches 0 as the design approaches the front.
        """
        scaled = (costs - self.low) / self.span
        if costs.shape[1] == 2:
            added = self._exact(scaled)
        else:
            free = self.samples[self.free]
            below = np.ones((len(costs), len(free)), dtype=bool)
            for cost, sample in zip(costs.T, free.T, strict=True):
                below &= cost[:, None] <= sample[None, :]
            added = below.sum(axis=1) / _MONTE_CARLO
        front = (self.front - self.low) / self.span
        # The improvement in all costs needed to match some design of the front in one cost.
        behind = np.max(np.min(scaled[:, None, :] - front[None], axis=2), axis=1)
        return np.where(added > 0, added, -np.maximum(behind, 0.0) - 1e-12)

    def _exact(self, scaled: Array) -> Array:
        front = (self.front - self.low) / self.span
        reference = (self.reference - self.low) / self.span
        front = front[np.argsort(front[:, 0])]
        edges = np.concatenate([[-np.inf], front[:, 0], reference[:1]])
        heights = np.concatenate([reference[1:], front[:, 1]])
        left = np.maximum(scaled[:, :1], edges[None, :-1])
        width = np.maximum(np.minimum(edges[1:], reference[0])[None] - left, 0.0)
        height = np.maximum(np.minimum(heights, reference[1])[None] - scaled[:, 1:], 0.0)
        return np.asarray((width * height).sum(axis=1))
