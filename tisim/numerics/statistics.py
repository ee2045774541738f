"""Confidence interval of the mean of independent runs."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import t as student

CONFIDENCE = 0.95
"""Default probability with which an interval contains the true mean."""


def half_width(values: ArrayLike, confidence: float = CONFIDENCE) -> Any:
    """Return half of the confidence interval of the mean over the first axis, by Student's t; inf for one
    value.

    Each component along further axes is treated by itself.
    """
    samples = np.asarray(values, float)
    n = len(samples)
    if n < 2:
        return np.full(samples.shape[1:], np.inf)[()]
    return student.ppf(0.5 + confidence / 2, n - 1) * samples.std(axis=0, ddof=1) / np.sqrt(n)
