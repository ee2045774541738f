"""How well the mean of independent runs is known."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import t as student

CONFIDENCE = 0.95
"""This is the probability with which an interval holds the true mean, where none other is asked for."""


def half_width(values: ArrayLike, confidence: float = CONFIDENCE) -> Any:
    """Return half of the confidence interval of the mean over the first axis, by Student's t; inf for one
    value.

    Spread over further axes is that of each component by itself.
    """
    samples = np.asarray(values, float)
    n = len(samples)
    if n < 2:
        return np.full(samples.shape[1:], np.inf)[()]
    return student.ppf(0.5 + confidence / 2, n - 1) * samples.std(axis=0, ddof=1) / np.sqrt(n)
