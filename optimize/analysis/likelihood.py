"""The likelihood of the genes, given measurements and the designs of a search.

Each measured quantity has a response to the genes (optimize.analysis.response). With the measured value m and
its uncertainty as the unit, mean q(u) and variance v(u) of the response at the design u, and the variance s
due to random starts common to all designs,

    -2 log L(u) = chi^2(u) + sum over the quantities of log(1 + s + v(u))
       chi^2(u) = sum over the quantities of (q(u) - m)^2 / (1 + s + v(u))

The estimate is the maximum of the likelihood near the designs that were run. The designs with chi^2 less
than 3.84 above its value there form the 95 % interval of one gene. With v = 0 this is the likelihood-ratio
interval. v is large where no designs were run. The likelihood is small there, since few of the possible
values of q are near m; but such designs are not excluded by any run, and chi^2 keeps them in the interval.
Only regions that contain designs that were run, or are connected to them, are searched: with many genes,
most corners of the ranges are never visited.

Source: M. C. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425-464; chi^2 as implausibility: I.
Vernon, M. Goldstein and R. G. Bower, Bayesian Anal. 5 (2010) 619-669, section 3; interval for v = 0: S. S.
Wilks, Ann. Math. Stat. 9 (1938) 60-62.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from tisim.optimize.analysis.evidence import Evidence
from tisim.optimize.analysis.response import Response
from tisim.optimize.surrogate.selection import MOST_LEARNED, representative

Array = NDArray[np.float64]

ONE_GENE_95 = 3.841
"""The 0.95 quantile of chi^2 with one degree of freedom."""
_BEGUN = 4
"""Number of designs, the most likely ones, from which the maximum is searched."""
_ROUNDING = 1e-5
"""An end of an interval this near to an end of the range is at it, in parts of the range."""
_GOAL_MET = 0.01
"""Deviation of chi^2 from 3.84 above the most likely point that is accepted at an end of an interval."""


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
        self._run = points
        self._chi2, logarithms = self._parts(points)
        begun = points[np.argsort(self._chi2 + logarithms)[:_BEGUN]]
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
            lambda u: float(self(u[None])[0]), begin, method="L-BFGS-B",
            jac=lambda u: np.sum(self._gradients(u), axis=0),
            bounds=[(0.0, 1.0)] * len(begin), options={"maxiter": 200, "ftol": 1e-12, "gtol": 1e-8},
        )  # fmt: skip
        return float(found.fun), np.clip(found.x, 0.0, 1.0)

    def interval(self, gene: int) -> tuple[Array, Array]:
        """Return the points with the smallest and the largest value of a gene in its 95 % interval.

        They have chi^2 at most 3.84 above the most likely point, with the other genes free within their
        ranges. They are searched from the most likely point, and from the designs in the interval.
        """
        return self._end(gene, -1.0), self._end(gene, 1.0)

    def _end(self, gene: int, sign: float) -> Array:
        """Return the point with the largest (sign 1) or smallest (-1) value of a gene in its interval."""
        goal = self.chi2 + ONE_GENE_95
        inside = self._run[self._chi2 <= goal]
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
        return np.asarray(np.linalg.inv(self.information + 12.0 * np.eye(len(self.best))))

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
