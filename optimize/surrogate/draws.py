"""Functions drawn from what a Gaussian process believes: through its values, as near as their noise allows.

A function of the process before any data is a sum of cosines of random frequencies (A. Rahimi and B. Recht,
NIPS 20 (2007)); those of the Matern 5/2 covariance have Student's distribution of five degrees of freedom
(GPML Eq. 4.15). The data bend it by what the process makes of the difference (J. T. Wilson and others, ICML
(2020), Eq. 13, the rule of Matheron).
"""

from __future__ import annotations

import math

import numpy as np
from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess

_COSINES = 512
"""Cosines of which a function is a sum."""
_DEGREES = 5
"""Degrees of freedom of the frequencies: twice the order of the covariance."""
_AT_ONCE = 4096
"""Points whose values are taken together, for the sake of memory."""


class Draws:
    """Functions drawn from a process, all defined everywhere.

    count : how many. rng : decides them.
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
