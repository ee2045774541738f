"""Functions drawn from the posterior of a Gaussian process.

A function of the prior is a sum of cosines with random frequencies; for the Matern 5/2 covariance the
frequencies have Student's distribution with five degrees of freedom. It is conditioned on the data by adding
the process's prediction of the difference (rule of Matheron).

Source: cosines: A. Rahimi and B. Recht, NIPS 20 (2007); frequencies: GPML Eq. 4.15; conditioning: J. T.
Wilson and others, ICML (2020), Eq. 13.
"""

from __future__ import annotations

import math

import numpy as np

from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess

_COSINES = 512
"""Number of cosines in the sum."""
_DEGREES = 5
"""Degrees of freedom of the frequencies: twice the order of the covariance."""
_AT_ONCE = 4096
"""Number of points evaluated at a time, to limit memory."""


class Draws:
    """Functions drawn from a process, all defined everywhere.

    count : number of functions. rng : random generator for the draws.
    """

    def __init__(self, model: GaussianProcess, count: int, rng: np.random.Generator) -> None:
        self.model = model
        parameters = model.parameters
        normal = rng.standard_normal((_COSINES, model.points.shape[1]))
        spread = np.sqrt(_DEGREES / rng.chisquare(_DEGREES, _COSINES))
        self._frequencies = normal * spread[:, None] / parameters.lengths
        self._phases = rng.uniform(0.0, 2.0 * math.pi, _COSINES)
        amplitude = math.sqrt(2.0 * parameters.signal / _COSINES)
        self._weights = amplitude * rng.standard_normal((_COSINES, count))
        noise = np.sqrt(model.noise + model.nugget)[:, None] * rng.standard_normal((len(model.points), count))
        self._missing = model.values[:, None] - self._prior(model.points) - noise

    def __call__(self, points: Array) -> Array:
        """Return the values of the functions at points (m, features), shape (draws, m)."""
        parts = []
        for first in range(0, len(points), _AT_ONCE):
            part = points[first : first + _AT_ONCE]
            across = self.model.covariance(part, self.model.points)
            parts.append(self._prior(part) + self.model.conditioned(across, self._missing))
        return self.model.centre + self.model.scale * np.vstack(parts).T

    def _prior(self, points: Array) -> Array:
        return np.asarray(np.cos(points @ self._frequencies.T + self._phases) @ self._weights)
