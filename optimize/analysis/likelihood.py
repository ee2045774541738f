"""The likelihood of the genes, given measurements and the designs of a search.

Each measured quantity has a response to the genes (optimize.analysis.response). With the measured value m and
its uncertainty as the unit, mean q(u) and variance v(u) of the response at the design u, and the variance s
due to random starts common to all designs,

    -2 log L(u) = chi^2(u) + sum over the quantities of log(1 + s + v(u))
       chi^2(u) = sum over the quantities of (q(u) - m)^2 / (1 + s + v(u))

The estimate is the most likely design. The designs with chi^2 less than 3.84 above its value there form the
95 % interval of one gene. With v = 0 this is the likelihood-ratio interval. v is large where no designs were
run. The likelihood is small there, since few of the possible values of q are near m; but such designs are not
excluded by any run, and chi^2 keeps them in the interval.

Source: M. C. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425-464; chi^2 as implausibility: I. Vernon,
M. Goldstein and R. G. Bower, Bayesian Anal. 5 (2010) 619-669, section 3; interval for v = 0: S. S. Wilks, Ann.
Math. Stat. 9 (1938) 60-62.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import qmc

from tisim.optimize.analysis.response import Response
from tisim.optimize.surrogate.selection import MOST_LEARNED, representative

Array = NDArray[np.float64]

ONE_GENE_95 = 3.841
"""The 0.95 quantile of chi^2 with one degree of freedom."""
NEAR_CHI2 = 12.0
"""Designs with chi^2 less than this above the least are near: 3.5 standard deviations along one gene."""
FAR_CHI2 = 60.0
"""Upper limit of that distance, which is enlarged if few designs are near."""
_PER_COEFFICIENT = 2.0
"""Number of near designs wanted for each coefficient of a quadratic form; the limit is enlarged beyond
NEAR_CHI2 to reach it."""
_SAMPLES, _BEGUN = 2048, 4
"""Number of points, a power of two, at which the likelihood is computed before it is maximised; number of
these from which the maximum is searched."""

_ROUNDING = 1e-5
"""An end of an interval this near to an end of the range is at it, in parts of the range."""
_GOAL_MET = 0.01
"""Deviation of chi^2 from 3.84 above the most likely point that is accepted at an end of an interval."""


@dataclass(frozen=True)
class Evidence:
    """Designs, and the distances of their quantities from the measurements.

    points : shape (designs, genes), of the unit cube.
    off : means over the starts of each design, in uncertainties, shape (designs, quantities).
    variance : of each mean due to the random starts, in squared uncertainties, the same shape; 0 if runs have
        no noise.
    shift : with starts common to all designs, the variance that they add to each measured quantity, shape
        (quantities,); else 0.
    chi2 : the sum of the squares of ``off``, without the part that is due to the random starts.
    """

    points: Array
    off: Array
    variance: Array
    shift: Array
    chi2: Array

    @classmethod
    def of_quantities(cls, points: Array, off: Sequence[Array], common: bool) -> Evidence:
        """Return the evidence of all runs.

        off : for each design the distance of its runs from the measurements, in uncertainties, shape (starts,
            quantities).
        common : whether all designs have the same starts.

        The squared distance of a mean over n starts is too large by its variance, s^2 / n, which is
        subtracted. Common starts move the quantities of all designs alike, by a random amount; differences
        between designs are then free of noise.
        """
        starts = np.array([len(one) for one in off], dtype=float)[:, None]
        means = np.array([one.mean(axis=0) for one in off])
        squares = np.array([((one - one.mean(axis=0)) ** 2).sum(axis=0) for one in off])
        freedom = np.maximum(starts - 1.0, 0.0)
        pooled = squares.sum(axis=0) / max(freedom.sum(), 1.0)
        own = np.where(starts > 1, squares / np.maximum(freedom, 1.0), pooled) / starts
        chi2 = (means**2 - own).sum(axis=1)
        if common:
            return cls(points, means, np.zeros_like(means), pooled / np.median(starts), chi2)
        return cls(points, means, pooled / starts, np.zeros_like(pooled), chi2)

    def of(self, chosen: NDArray[np.bool_], genes: Sequence[int]) -> Evidence:
        """Return the evidence of chosen designs and genes."""
        return Evidence(
            self.points[chosen][:, genes], self.off[chosen], self.variance[chosen], self.shift, self.chi2[chosen]
        )

    @property
    def missing(self) -> int:
        """The number of further designs near the least misfit that are needed for a likelihood; 0 if it has
        enough."""
        above = np.sort(self.chi2 - self.chi2.min())
        count = coefficients(self.points.shape[1])
        enough = math.ceil(_PER_COEFFICIENT * count)
        within = min(max(NEAR_CHI2, float(above[min(enough, len(above)) - 1]) * (1 + 1e-12)), FAR_CHI2)
        return 0 if np.sum(above < within) >= count + 2 else enough - int(np.sum(above < NEAR_CHI2))


class Likelihood:
    """The likelihood of the genes, points of the unit cube.

    best : the most likely point. chi2 : chi^2 there.
    designs : number of designs that the responses are known from.
    """

    def __init__(self, evidence: Evidence) -> None:
        self.shift = evidence.shift
        # With noise, the designs of least chi^2 are partly lucky, and are not preferred.
        exact = not np.any(evidence.variance)
        chosen = representative(evidence.chi2[:, None], MOST_LEARNED, exact)
        points, self.designs = evidence.points[chosen], len(chosen)
        parts = zip(evidence.off[chosen].T, evidence.variance[chosen].T, strict=True)
        self.responses = [Response(points, off, variance) for off, variance in parts]
        genes = points.shape[1]
        drawn = qmc.Sobol(genes, seed=1).random(_SAMPLES)
        self._seen = np.vstack([drawn, evidence.points[np.argsort(evidence.chi2)[:_SAMPLES]]])
        self._chi2, logarithms = self._parts(self._seen)
        begun = self._seen[np.argsort(self._chi2 + logarithms)[:_BEGUN]]
        found = [self._minimised(point) for point in begun]
        _, self.best = min(found, key=lambda one: one[0])
        self.chi2 = float(self._parts(self.best[None])[0][0])

    def __call__(self, points: Array) -> Array:
        """Return -2 log L at points (m, genes), shape (m,)."""
        chi2, logarithms = self._parts(points)
        return chi2 + logarithms

    def _parts(self, points: Array) -> tuple[Array, Array]:
        """Return chi^2 and the sum of the logarithms at points (m, genes), both (m,)."""
        chi2, logarithms = np.zeros((2, len(points)))
        for response, shift in zip(self.responses, self.shift, strict=True):
            mean, variance = response.predict(points)
            variance = 1.0 + shift + variance
            chi2 += mean**2 / variance
            logarithms += np.log(variance)
        return chi2, logarithms

    def _gradients(self, point: Array) -> tuple[Array, Array]:
        """Return the gradients of chi^2 and the sum of the logarithms at a point, both (genes,)."""
        chi2, logarithms = np.zeros((2, len(point)))
        for response, shift in zip(self.responses, self.shift, strict=True):
            mean, variance = (float(one[0]) for one in response.predict(point))
            of_mean, of_variance = response.gradients(point)
            variance += 1.0 + shift
            chi2 += 2.0 * mean / variance * of_mean - (mean / variance) ** 2 * of_variance
            logarithms += of_variance / variance
        return chi2, logarithms

    def _minimised(self, begin: Array) -> tuple[float, Array]:
        found = minimize(
            lambda u: float(self(u[None])[0]), begin, jac=lambda u: sum(self._gradients(u)), method="L-BFGS-B",
            bounds=[(0.0, 1.0)] * len(begin), options={"maxiter": 200, "ftol": 1e-12, "gtol": 1e-8},
        )  # fmt: skip
        return float(found.fun), np.clip(found.x, 0.0, 1.0)

    def interval(self, gene: int) -> tuple[Array, Array]:
        """Return the points with the smallest and the largest value of a gene in its 95 % interval.

        They have chi^2 at most 3.84 above the most likely point, with the other genes free within their
        ranges.
        """
        return self._end(gene, -1.0), self._end(gene, 1.0)

    def _end(self, gene: int, sign: float) -> Array:
        """Return the point with the largest (sign 1) or smallest (-1) value of a gene in its interval."""
        goal = self.chi2 + ONE_GENE_95
        inside = self._seen[self._chi2 <= goal]
        begun = [self.best, *inside[np.argsort(-sign * inside[:, gene])][:1]]
        scale, ahead = np.sqrt(np.diag(self.covariance)), sign * np.eye(len(self.best))[gene]
        ends = list(begun)
        for begin in begun:
            found = minimize(
                lambda x: -float(ahead @ x), begin / scale, jac=lambda x: -ahead, method="SLSQP",
                bounds=[(0.0, 1.0 / one) for one in scale],
                constraints={
                    "type": "ineq",
                    "fun": lambda x: goal - float(self._parts((x * scale)[None])[0][0]),
                    "jac": lambda x: -self._gradients(x * scale)[0] * scale,
                },
                options={"maxiter": 100, "ftol": 1e-5},
            )  # fmt: skip
            at = found.x * scale
            at = np.where(at < _ROUNDING, 0.0, np.where(at > 1.0 - _ROUNDING, 1.0, at))
            if float(self._parts(at[None])[0][0]) <= goal + _GOAL_MET:
                ends.append(at)
        return max(ends, key=lambda at: float(ahead @ at))

    def unknown(self, point: Array) -> Array:
        """Return the standard deviation of each quantity at a point that is due to the finite number of runs,
        in uncertainties of its measurement, shape (quantities,)."""
        return np.sqrt([float(response.predict(point)[1][0]) for response in self.responses])

    @property
    def information(self) -> Array:
        """The Fisher information of the measurements at the best point: J^T V^-1 J, with J the gradients of
        the responses and V their variances."""
        total = np.zeros((len(self.best), len(self.best)))
        for response, shift in zip(self.responses, self.shift, strict=True):
            slope = response.gradients(self.best)[0]
            variance = 1.0 + shift + float(response.predict(self.best)[1][0])
            total += np.outer(slope, slope) / variance
        return total

    @property
    def covariance(self) -> Array:
        """The covariance of the estimates, given that each gene lies within its range.

        Along an undetermined direction rounding errors would correlate all genes. The variance 1/12 of a
        range, added as prior information, limits such a direction.
        """
        return np.linalg.inv(self.information + 12.0 * np.eye(len(self.best)))

    @property
    def correlation(self) -> Array:
        """The correlation matrix of the estimates."""
        covariance = self.covariance
        deviation = np.sqrt(np.diag(covariance))
        return np.asarray(covariance / np.outer(deviation, deviation))

    def growth(self) -> tuple[Array, Array]:
        """Return the growth of chi^2 along each principal direction, from the centre of the unit cube to its
        surface, smallest first; and the directions, shape (genes, directions)."""
        values, vectors = np.linalg.eigh(self.information)
        length = 0.5 / np.max(np.abs(vectors), axis=0)
        return np.maximum(values, 0.0) * length**2, vectors


def coefficients(genes: int) -> int:
    """Return the number of coefficients of a quadratic form of this number of genes."""
    return (genes + 1) * (genes + 2) // 2
