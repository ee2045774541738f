"""Intervals hold the mean in 93 to 97 of 100 samples, of few, skewed, equal and rare values."""

import math

import numpy as np
import pytest

from tisim.numerics.skewed import interval

SAMPLES = 1000
KINDS_OF_NOISE = {
    "normal": lambda rng, n: 1 + 0.3 * rng.normal(size=(SAMPLES, n)),
    "exponential": lambda rng, n: rng.exponential(size=(SAMPLES, n)),
    "exponential to the left": lambda rng, n: 2 - rng.exponential(size=(SAMPLES, n)),
    "captured of 20": lambda rng, n: rng.binomial(20, 0.3, size=(SAMPLES, n)) / 6,
    "captured of 60, rarely": lambda rng, n: rng.binomial(60, 0.02, size=(SAMPLES, n)) / 1.2,
    "one of ten is 4, else 2/3": lambda rng, n: np.where(rng.random((SAMPLES, n)) < 0.1, 4.0, 2 / 3),
    "lognormal": lambda rng, n: np.exp(0.8 * rng.normal(size=(SAMPLES, n)) - 0.32),
}


@pytest.mark.parametrize("starts", [12, 16, 24])
@pytest.mark.parametrize("noise", KINDS_OF_NOISE)
def test_coverage(noise, starts):
    """Of rare and discrete values it may be more; of lognormal ones, of skewness 3.7, it is somewhat less."""
    rng = np.random.default_rng(starts)
    draw = KINDS_OF_NOISE[noise]
    seen = np.unique(draw(rng, 1)[:100])
    seen = seen[[0, len(seen) // 2, -1]]
    covered = np.mean([low <= 1 <= high for low, high in (interval(row, seen) for row in draw(rng, starts))])
    spread = 2 * math.sqrt(0.05 * 0.95 / SAMPLES)
    assert covered > (0.91 if noise == "lognormal" else 0.93) - spread
    assert covered < (1.0 if "rarely" in noise or "one of ten" in noise else 0.97 + spread)


def test_equal_values_tell_nothing_but_that_others_are_rare():
    assert interval([0.3] * 12) == pytest.approx((math.nan, math.nan), nan_ok=True)
    low, high = interval([0.0] * 12, [1.0])
    # 1/2 (1 - p)^12 = 0.025, the mid-P of twelve failures.
    assert (low, high) == (0.0, pytest.approx(1 - 0.05 ** (1 / 12)))
    low, high = interval([0.5] * 12, [0.0, 2.0])
    rare = 1 - 0.05 ** (1 / 12)
    assert (low, high) == (pytest.approx(0.5 - 0.5 * rare), pytest.approx(0.5 + 1.5 * rare))
    assert all(map(math.isnan, interval([1.0])))


def test_without_skewness_it_is_that_of_student():
    assert interval([1.0, 2.0, 3.0]) == pytest.approx((2 - 2.4841377, 2 + 2.4841377), rel=1e-6)
