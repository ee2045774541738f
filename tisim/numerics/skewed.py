"""Confidence intervals of the mean of few, skewed or nearly equal values."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.stats import binom
from scipy.stats import t as student

from tisim.numerics.statistics import CONFIDENCE


@dataclass(frozen=True)
class Moments:
    """Second and third central moments of the noise of values, without bias, and how many values these are
    from."""

    second: float
    third: float
    count: float

    @property
    def skewness(self) -> float:
        """The skewness; 0 where all values are equal."""
        return self.third / self.second**1.5 if self.second > 0 else 0.0

    def __add__(self, other: Moments) -> Moments:
        """Return the moments of both sets of values together."""
        count = self.count + other.count
        second = self.count * self.second + other.count * other.second
        third = self.count * self.third + other.count * other.third
        return Moments(second / count, third / count, count)

    @classmethod
    def of(cls, values: ArrayLike) -> Moments:
        """Return those of independent values, three or more: Fisher's k-statistics (M. G. Kendall and A.
        Stuart, The Advanced Theory of Statistics, vol. 1, 4th ed. (1977), section 12.9)."""
        sample = np.asarray(values, dtype=float)
        n = len(sample)
        off = sample - sample.mean()
        second, third = float(np.sum(off**2)) / (n - 1), float(np.sum(off**3)) * n / ((n - 1) * (n - 2))
        return cls(second, third, float(n))


def interval(
    values: ArrayLike,
    support: ArrayLike = (),
    skewness: float | None = None,
    confidence: float = CONFIDENCE,
) -> tuple[float, float]:
    """Return the ends of the confidence interval of the mean of independent values, shape (n,).

    Student's t, corrected for the skewness of the values by the cubic transformation of P. Hall, J. R. Stat.
    Soc. B 54 (1992) 221-228. Two kinds of values have a rule of their own:

    - Where no more than two different values are known, the interval is that of a binomial share, by mid-P
      (H. O. Lancaster, J. Am. Stat. Assoc. 56 (1961) 223-234). Twelve equal values leave a share of 0.22 for
      another one.
    - Equal values otherwise tell nothing of what the rarer ones are; they are taken to be anywhere between
      the ends of ``support``.

    support : values that are known to occur, for instance in other samples, or ends of the range.
    skewness : that for which to correct, where more is known of it than by these values (see
    ``shared_skewness``). (NaN, NaN) where no interval is known: for one value, and for equal values when no
    other value is known.
    """
    sample = np.asarray(values, dtype=float)
    known = np.unique(np.concatenate([sample, np.ravel(support)]))
    n, mean = len(sample), float(np.mean(sample))
    if n < 2 or len(known) == 1:
        return math.nan, math.nan
    low, high = float(known[0]), float(known[-1])
    if len(known) == 2 or np.ptp(sample) == 0:
        if len(known) == 2:
            ends = _binomial_share(round(n * (mean - low) / (high - low)), n, confidence)
            return low + ends[0] * (high - low), low + ends[1] * (high - low)
        rare = _binomial_share(0, n, confidence)[1]
        return mean - rare * (mean - low), mean + rare * (high - mean)
    deviation = float(np.std(sample, ddof=1))
    if skewness is None:
        skewness = sample_skewness(sample)
    quantile = float(student.ppf(0.5 + confidence / 2, n - 1)) / math.sqrt(n)
    return (
        mean - deviation * _transformed_back(quantile, skewness, n),
        mean - deviation * _transformed_back(-quantile, skewness, n),
    )


def sample_skewness(values: ArrayLike) -> float:
    """Return the skewness of values as they are, which is less than that of what they are drawn from; 0 for
    equal ones."""
    sample = np.asarray(values, dtype=float)
    off = sample - sample.mean()
    deviation = math.sqrt(float(np.mean(off**2)))
    return float(np.mean(off**3)) / deviation**3 if deviation > 0 else 0.0


def shared_skewness(samples: Sequence[ArrayLike], others: Moments | None = None) -> float | None:
    """Return the skewness for which to correct the interval of each of several samples whose noise is alike.

    A dozen values that have had no rare one look as if there were none; other samples have had it. So the
    moments of all samples are taken together, with those of ``others``. The skewness of what values are drawn
    from corrects too much for few of them, whose deviation grows with their mean: of samples of n, 1 - 1.1 /
    sqrt(n) of it. That holds the mean most evenly over normal, exponential, lognormal and chi-square noise
    and rare events (tests/numerics/test_skewed.py). It is no less than the mean of the samples' own.
    None where there is nothing but a single sample.
    """
    large = [one for one in map(np.asarray, samples) if len(one) > 2]
    if not large or (len(large) == 1 and others is None):
        return None
    together = functools.reduce(operator.add, map(Moments.of, large))
    if others is not None:
        together += others
    n = float(np.mean([len(one) for one in large]))
    shared = (1.0 - 1.1 / math.sqrt(n)) * together.skewness
    own = float(np.mean([sample_skewness(one) for one in large]))
    return shared if abs(shared) >= abs(own) else own


def _binomial_share(successes: int, trials: int, confidence: float) -> tuple[float, float]:
    """Return the ends of the interval of a probability, at which the mid-P of both tails is equal."""
    tail = 0.5 - confidence / 2

    def end(count: int) -> float:
        """Where no more than ``count`` successes have the probability of the tail, half of that of ``count``
        itself taken off."""
        return float(
            brentq(lambda p: binom.cdf(count, trials, p) - binom.pmf(count, trials, p) / 2 - tail, 0.0, 1.0)
        )

    low = 0.0 if successes == 0 else 1.0 - end(trials - successes)
    high = 1.0 if successes == trials else end(successes)
    return low, high


def _transformed_back(y: float, skewness: float, n: int) -> float:
    """Return x with x + g x^2 / 3 + g^2 x^3 / 27 + g / 6 n = y (Hall 1992, T = (mean - mu) / s = x)."""
    if abs(skewness) < 1e-8:
        return y
    return float((np.cbrt(1.0 + skewness * (y - skewness / (6.0 * n))) - 1.0) / (skewness / 3.0))
