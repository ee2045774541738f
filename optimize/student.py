"""The factor of a confidence interval of a mean: two-sided quantiles of Student's t distribution."""

from __future__ import annotations

import math

from tisim.errors import must


def _inside(t: float, degrees: int) -> float:
    """Probability of |T| < t for a whole number of degrees of freedom.

    Finite series, exact: Abramowitz & Stegun, Handbook of Mathematical Functions, 26.7.3 and 26.7.4.
    """
    theta = math.atan(t / math.sqrt(degrees))
    cos2 = math.cos(theta) ** 2
    odd = degrees % 2
    term, total = (math.cos(theta), 0.0) if odd else (1.0, 0.0)
    for k in range(2 + odd, degrees + 1, 2):
        total += term
        term *= cos2 * (k - 1) / k
    total *= math.sin(theta)
    return 2 / math.pi * (theta + total) if odd else total


def student_t(degrees: int, probability: float = 0.95) -> float:
    """t such that |T| < t has the given probability, for degrees >= 1 of freedom (e.g. 2.2010 for 11).

    InputError for degrees < 1 or a probability outside 0..1. Accurate to about 1e-12 relative.
    """
    must(degrees >= 1, "degrees of freedom", ">= 1", degrees)
    must(0 < probability < 1, "probability", "within 0..1", probability)
    low, high = 0.0, 1.0
    while _inside(high, degrees) < probability:
        high *= 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _inside(middle, degrees) < probability else (low, middle)
    return high
