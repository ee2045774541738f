"""A Gaussian process: a smooth function through values of known noise, and its uncertainty between them.

Source: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press (2006), here
GPML: prediction Eq. 2.25 and 2.26, marginal likelihood Eq. 2.30, its gradient Eq. 5.9, Matern covariance Eq.
4.17.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import minimize

from tisim.optimize.surrogate.selection import representative

Array = NDArray[np.float64]

MOST_FITTED = 300
"""Largest number of points used to fit the length scales; the cost is cubic in it. Of more points, this
number is chosen."""
_JITTER = 1e-8
"""Least noise variance, as a fraction of the variance of the values: rounding of nearly equal points."""
NUGGET, EXACT_NUGGET = 1e-3, 1e-6
"""Medians of the prior of the nugget, for values with and without noise."""
_SPREAD = {"length": 1.0, "signal": 1.5, "nugget": 3.0}
"""Standard deviations of the logarithms of the parameters in their priors."""


@dataclass(frozen=True, eq=False)
class Parameters:
    """Parameters of the covariance, in units of the standardised values.

    lengths : length scales, shape (features,), in units of the feature.
    signal : variance of the function.
    nugget : variance that is added to the known noise.
    """

    lengths: Array
    signal: float
    nugget: float

    @classmethod
    def prior(cls, features: int, nugget: float = NUGGET) -> Parameters:
        """Return the medians of the priors.

        Length scales grow with the square root of the dimension, as distances do.

        Source: C. Hvarfner, E. O. Hellsten and L. Nardi, Vanilla Bayesian optimization performs great in high
        dimensions, ICML (2024).
        """
        return cls(np.full(features, 0.35 * math.sqrt(features)), 1.0, nugget)

    @property
    def logarithms(self) -> Array:
        return np.log([*self.lengths, self.signal, self.nugget])

    @classmethod
    def of(cls, logarithms: Array) -> Parameters:
        values = np.exp(logarithms)
        return cls(values[:-2], float(values[-2]), float(values[-1]))


class GaussianProcess:
    """A Gaussian process with the Matern 5/2 covariance and a length scale for each feature.

    points : shape (n, features). values : shape (n,). variance : of the noise in each value, shape (n,).
    parameters : given; or fitted by maximum posterior density, starting from ``start``.
    exact : whether the values are known to have no noise.

    The prior mean is the mean of the values. Since most values of a search come from good regions, the
    process expects unknown regions to be nearly as good, which favours exploration. The parameters are fitted
    with the most likely constant as the mean.
    """

    def __init__(
        self,
        points: Array,
        values: Array,
        variance: Array,
        parameters: Parameters | None = None,
        start: Parameters | None = None,
        iterations: int = 50,
        exact: bool = False,
    ) -> None:
        self.points = np.asarray(points, dtype=float)
        values = np.asarray(values, dtype=float)
        self.centre, self.scale = float(np.mean(values)), float(np.std(values)) or 1.0
        self.values = (values - self.centre) / self.scale
        self.noise = np.asarray(variance, dtype=float) / self.scale**2
        if parameters is None:
            parameters = self._fitted(start, iterations, exact)
        self.parameters = parameters
        covariance = _matern(self.points, self.points, parameters)
        covariance[np.diag_indices_from(covariance)] += self.noise + self.nugget
        self._factor = _factor(covariance)
        self._weights = cho_solve(self._factor, self.values)

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation of the function, without noise, at points (m, features)."""
        across = _matern(np.atleast_2d(points), self.points, self.parameters)
        mean = across @ self._weights
        solved = solve_triangular(self._factor[0], across.T, lower=True, check_finite=False)
        left = self.parameters.signal - np.einsum("ij,ij->j", solved, solved)
        return self.centre + self.scale * mean, self.scale * np.sqrt(np.maximum(left, 1e-12))

    def half_solved(self, points: Array) -> Array:
        """Return L^-1 k for each point, shape (n, m).

        The posterior covariance is k(a, b) - half_solved(a).T @ half_solved(b).
        """
        return self.whitened(_matern(self.points, np.atleast_2d(points), self.parameters))

    def whitened(self, columns: Array) -> Array:
        """Return L^-1 times the columns, shape (n, m), with L L^T the covariance of the noisy values."""
        return np.asarray(solve_triangular(self._factor[0], columns, lower=True, check_finite=False))

    def left_out(self) -> tuple[Array, Array]:
        """Return the leave-one-out residual of each value and its standard deviation, both (n,), with the
        parameters of all (GPML Eq. 5.10 to 5.12)."""
        inverse = cho_solve(self._factor, np.eye(len(self.points)), check_finite=False)
        precision = np.diag(inverse)
        return self.scale * (inverse @ self.values) / precision, self.scale / np.sqrt(precision)

    def conditioned(self, across: Array, values: Array) -> Array:
        """Return the means of a process with other values at its points, shape (m, draws).

        across : covariance with its points, shape (m, n). values : shape (n, draws), in standardised units,
            as the result.
        """
        return np.asarray(across @ cho_solve(self._factor, values, check_finite=False))

    def covariance(self, points: Array, others: Array) -> Array:
        """Return the prior covariance of the function, shape (m, k), in standardised units."""
        return _matern(points, others, self.parameters)

    def covariance_gradient(self, point: Array) -> Array:
        """Return the gradient of the prior covariance of the function at a point with its value at each of
        the points of the process, shape (n, features), in standardised units."""
        off = point - self.points
        root = np.sqrt(5.0 * ((off / self.parameters.lengths) ** 2).sum(axis=1))
        slope = -self.parameters.signal * (5.0 / 3.0) * (1.0 + root) * np.exp(-root)
        return np.asarray(slope[:, None] * off / self.parameters.lengths**2)

    @property
    def nugget(self) -> float:
        """The variance of a value in addition to its known noise, in standardised units."""
        return self.parameters.nugget + _JITTER

    def _fitted(self, start: Parameters | None, iterations: int, exact: bool) -> Parameters:
        """Return the parameters of largest posterior density, searched from the prior's medians or from
        ``start``."""
        prior = Parameters.prior(self.points.shape[1], EXACT_NUGGET if exact else NUGGET)
        chosen = representative(self.values[:, None], MOST_FITTED, exact)
        likelihood = _Likelihood(self.points[chosen], self.values[chosen], self.noise[chosen], prior)
        bounds = [(math.log(0.01), math.log(100.0))] * self.points.shape[1]
        bounds += [(math.log(1e-3), math.log(1e3)), (math.log(1e-8), math.log(2.0))]
        best_value, best_at = math.inf, prior.logarithms
        for begin in [prior] if start is None else [start]:
            found = minimize(
                likelihood, np.clip(begin.logarithms, *np.transpose(bounds)), jac=True, method="L-BFGS-B",
                bounds=bounds, options={"maxiter": iterations},
            )  # fmt: skip
            if found.fun < best_value:
                best_value, best_at = float(found.fun), found.x
        return Parameters.of(best_at)


class _Likelihood:
    """Minus the log posterior density of the parameters, and its gradient (GPML Eq. 5.8, 5.9)."""

    def __init__(self, points: Array, values: Array, noise: Array, prior: Parameters) -> None:
        self.values, self.noise = values, noise
        self.squares = (points[:, None, :] - points[None, :, :]) ** 2
        self.prior = prior.logarithms
        features = points.shape[1]
        self.spread = np.array([_SPREAD["length"]] * features + [_SPREAD["signal"], _SPREAD["nugget"]])

    def __call__(self, logarithms: Array) -> tuple[float, Array]:
        parameters = Parameters.of(logarithms)
        inverse_squares = parameters.lengths**-2
        root = np.sqrt(5.0 * (self.squares @ inverse_squares))
        decay = np.exp(-root)
        correlation = (1.0 + root + root**2 / 3.0) * decay
        covariance = parameters.signal * correlation
        covariance[np.diag_indices_from(covariance)] += self.noise + parameters.nugget + _JITTER
        factor = _factor(covariance)
        n = len(self.values)
        inverse = cho_solve(factor, np.eye(n), check_finite=False)
        ones = inverse.sum(axis=1)
        residual = self.values - float(ones @ self.values) / float(ones.sum())
        weights = inverse @ residual
        value = 0.5 * float(residual @ weights) + float(np.log(np.diag(factor[0])).sum())
        # d K / d log l_j = s (5/3) (1 + r) exp(-r) (x_j - x'_j)^2 / l_j^2, r the root above.
        outer = 0.5 * (inverse - np.outer(weights, weights))
        common = outer * (parameters.signal * (5.0 / 3.0) * (1.0 + root) * decay)
        gradient = np.empty_like(logarithms)
        gradient[:-2] = np.tensordot(common, self.squares, axes=2) * inverse_squares
        gradient[-2] = np.sum(outer * correlation) * parameters.signal
        gradient[-1] = np.trace(outer) * parameters.nugget
        off = (logarithms - self.prior) / self.spread
        return value + 0.5 * float(off @ off), gradient + off / self.spread


def _matern(one: Array, other: Array, parameters: Parameters) -> Array:
    """Return the covariance of the function between points, shape (m, n) (GPML Eq. 4.17)."""
    a, b = one / parameters.lengths, other / parameters.lengths
    squares = (a**2).sum(1)[:, None] + (b**2).sum(1)[None, :] - 2.0 * a @ b.T
    root = np.sqrt(5.0 * np.maximum(squares, 0.0))
    return parameters.signal * (1.0 + root + root**2 / 3.0) * np.exp(-root)


def _factor(covariance: Array) -> tuple[Array, bool]:
    """Return the lower Cholesky factor; if rounding prevents it, the factor of the covariance plus a small
    diagonal."""
    more = 0.0
    while True:
        try:
            shifted = covariance + more * np.eye(len(covariance)) if more else covariance
            return cho_factor(shifted, lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            more = 10.0 * more or 1e-8 * float(np.trace(covariance)) / len(covariance)
