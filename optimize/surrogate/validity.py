"""The probability that a design does not fail, from the designs that did and did not.

A scene may be refused, or diverge, in a part of the range. The cost of such a design is not known, and any
cost put in its place bends the process of the costs near the edge, where the best design often lies. The
costs are therefore learned from the designs that did not fail, and the worth of a run is multiplied by the
probability that it does not fail.

Source: probability of feasibility: M. Schonlau, W. J. Welch and D. R. Jones, IMS Lecture Notes 34 (1998)
11-25; least-squares classification: GPML section 6.5.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess, Parameters
from tisim.optimize.surrogate.selection import MOST_LEARNED

_SOFT = 0.1
"""Least standard deviation of a predicted label, whose values are 1 and -1."""


class Validity:
    """A Gaussian process of the labels 1 (did not fail) and -1 (failed).

    features : function of points of the unit cube, (n, genes) -> (n, features).
    points : of the designs that have run, (n, genes). failed : whether each has failed, (n,).
    start : parameters from which the fit begins; None for the medians of their priors.
    """

    def __init__(
        self,
        features: Callable[[Array], Array],
        points: Array,
        failed: NDArray[np.bool_],
        start: Parameters | None = None,
    ) -> None:
        chosen = np.linspace(0, len(points) - 1, min(len(points), MOST_LEARNED)).astype(np.intp)
        labels = np.where(failed[chosen], -1.0, 1.0)
        self.features = features
        self.model = GaussianProcess(
            features(points[chosen]), labels, np.zeros(len(chosen)), start=start, iterations=30
        )

    def log_probability(self, points: Array) -> Array:
        """Return the logarithm of the probability that designs, (m, genes), do not fail, shape (m,)."""
        mean, deviation = self.model.predict(self.features(np.atleast_2d(points)))
        return np.asarray(log_ndtr(mean / np.hypot(deviation, _SOFT)))
