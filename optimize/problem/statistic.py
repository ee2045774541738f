"""Statistics that combine the values of a design from its random starts: mean, quantile, worst of n, misfit.

Each has an estimate, a standard error by the jackknife (B. Efron, The Jackknife, the Bootstrap and Other
Resampling Plans, SIAM (1982), chapter 3), and a 95 % confidence interval.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, comb

from tisim.errors import is_number, must
from tisim.numerics import intervals, skewed
from tisim.numerics.statistics import CONFIDENCE

Array = NDArray[np.float64]
Ends = tuple[float, float]


@dataclass(frozen=True)
class Others:
    """Information from the runs of other designs.

    seen : values that have occurred. skewness : skewness of the noise, None if it is not known.
    """

    seen: Sequence[float] = ()
    skewness: float | None = None


NO_OTHERS = Others()
"""No information from other designs."""


class Statistic(ABC):
    """A number computed from the values of all starts of a design; small values are better.

    Values have the shape (starts,), or (starts, quantities) if ``quantities`` are named.
    """

    @property
    @abstractmethod
    def label(self) -> str:
        """The statistic's part of a table heading."""

    @property
    def described(self) -> str:
        """A text of all properties that determine its value; "" for the mean. Part of the identity of a
        search."""
        return repr(self)

    @property
    def fewest_starts(self) -> int:
        """The smallest number of starts for an estimate."""
        return 2

    @property
    def fewest_fresh(self) -> int:
        """The smallest number of starts for an interval with two finite ends."""
        return self.fewest_starts

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of the quantities of a run that it needs; () for a single unnamed value."""
        return ()

    @property
    def mirrored(self) -> Statistic:
        """The statistic to apply to the negated values of a maximised objective."""
        return self

    @abstractmethod
    def value(self, values: Array) -> float:
        """Return the estimate from one or more starts."""

    @abstractmethod
    def interval(self, values: Array, others: Others = NO_OTHERS, confidence: float = CONFIDENCE) -> Ends:
        """Return the ends of the confidence interval, NaN for an end that is not known.

        others : used only for the mean (tisim.numerics.skewed).
        """

    def pseudo_values(self, values: Array) -> Array:
        """Return the jackknife pseudo-value of each start, shape (starts,).

            n theta - (n - 1) theta_without_i

        Their mean approximates theta (Efron 1982, Eq. 3.10).
        """
        n = len(values)
        if n < 2:
            return np.full(n, self.value(values))
        without = [self.value(np.delete(values, i, axis=0)) for i in range(n)]
        return n * self.value(values) - (n - 1) * np.array(without)


@dataclass(frozen=True)
class Expectation(Statistic):
    """The mean over the starts."""

    @property
    def label(self) -> str:
        return ""

    @property
    def described(self) -> str:
        return ""

    @property
    def fewest_starts(self) -> int:
        return 1

    def value(self, values: Array) -> float:
        return float(np.cumsum(values)[-1] / len(values))  # a running mean has the same last bits

    def pseudo_values(self, values: Array) -> Array:
        return np.asarray(values, dtype=float)

    def interval(self, values: Array, others: Others = NO_OTHERS, confidence: float = CONFIDENCE) -> Ends:
        return skewed.interval(values, others.seen, others.skewness, confidence)


@dataclass(frozen=True)
class Quantile(Statistic):
    """The quantile: the value that a given share of all starts do not exceed.

    share : between 0 and 1; for example 0.9 of a loss that is minimised, 0.1 of a yield that is maximised.

    The estimate is a weighted sum of the sorted values. The interval uses order statistics
    (intervals.of_quantile). Each design gets enough starts that one is expected beyond the quantile: 10 for
    0.9.

    Source: F. E. Harrell and C. E. Davis, Biometrika 69 (1982) 635-640.
    """

    share: float

    def __post_init__(self) -> None:
        must(
            is_number(self.share) and 0 < self.share < 1, "share of a quantile", "between 0 and 1", self.share
        )

    @property
    def label(self) -> str:
        return f"{self.share:g} quantile"

    @property
    def mirrored(self) -> Statistic:
        return Quantile(1.0 - self.share)

    @property
    def fewest_starts(self) -> int:
        return max(2, math.ceil(round(1.0 / min(self.share, 1.0 - self.share), 9)))

    @property
    def fewest_fresh(self) -> int:
        return intervals.fewest_of_quantile(self.share)

    def value(self, values: Array) -> float:
        n = len(values)
        edges = betainc((n + 1) * self.share, (n + 1) * (1 - self.share), np.linspace(0.0, 1.0, n + 1))
        return float(np.sort(values) @ np.diff(edges))

    def interval(self, values: Array, others: Others = NO_OTHERS, confidence: float = CONFIDENCE) -> Ends:
        return intervals.of_quantile(values, self.share, confidence)


@dataclass(frozen=True)
class WorstOf(Statistic):
    """The expected worst value of n starts: the largest of minimised values, the smallest of maximised ones.

    starts : n, 2 or more. The estimate is the mean of the worst value over all subsets of n starts. It is
        unbiased, so designs with different numbers of starts can be compared.
    """

    starts: int

    def __post_init__(self) -> None:
        whole = isinstance(self.starts, int) and not isinstance(self.starts, bool) and self.starts > 1
        must(whole, "starts of WorstOf", "a whole number above 1", self.starts)

    @property
    def label(self) -> str:
        return f"worst of {self.starts} starts"

    @property
    def fewest_starts(self) -> int:
        return self.starts + 1

    @property
    def fewest_fresh(self) -> int:
        return 4 * self.starts

    def value(self, values: Array) -> float:
        n = len(values)
        if n < self.starts:
            return float(np.max(values))
        weights = comb(np.arange(n), self.starts - 1) / comb(n, self.starts)
        return float(np.sort(values) @ weights)

    def interval(self, values: Array, others: Others = NO_OTHERS, confidence: float = CONFIDENCE) -> Ends:
        if len(values) <= self.starts:
            return _UNKNOWN
        return skewed.interval(self.pseudo_values(values), confidence=confidence)


@dataclass(frozen=True)
class Misfit(Statistic):
    """The misfit of the means over the starts to measurements: chi^2 divided by the number of quantities.

        mean over the quantities of ((mean - measured) / uncertainty)^2

    measured : quantity -> (measured value, its standard uncertainty), both in the unit of the quantity. The
        function of the objective returns a dictionary with these names.

    The squared distance of a mean over n starts is too large by the variance of the mean, which is
    subtracted. The estimate is therefore unbiased, and may be negative for a design that meets the
    measurements. The designs of such a search determine confidence intervals of the genes
    (optimize.calibration).
    """

    measured: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        must(isinstance(self.measured, Mapping) and len(self.measured) > 0, "measured of a Misfit",
             "a dictionary of quantity: (value, uncertainty)", self.measured)  # fmt: skip
        for name, pair in self.measured.items():
            must(
                isinstance(name, str) and bool(name.strip()),
                "quantity of a Misfit",
                "a non-empty string",
                name,
            )
            two = isinstance(pair, tuple | list) and len(pair) == 2 and all(map(is_number, pair))
            sound = two and math.isfinite(pair[0]) and 0 < pair[1] < math.inf
            must(sound, f"measured {name}", "(value, uncertainty above 0), both finite", pair)
        plain = {name: (float(value), float(error)) for name, (value, error) in self.measured.items()}
        object.__setattr__(self, "measured", plain)

    @property
    def label(self) -> str:
        return ""

    @property
    def fewest_starts(self) -> int:
        return 1

    @property
    def fewest_fresh(self) -> int:
        return 2

    @property
    def quantities(self) -> tuple[str, ...]:
        return tuple(self.measured)

    def off(self, values: Array) -> Array:
        """Return (values - measured) / uncertainty, shape (..., quantities)."""
        wanted, uncertainty = np.array(list(self.measured.values())).T
        return np.asarray((values - wanted) / uncertainty)

    def value(self, values: Array) -> float:
        off = self.off(values)
        n = len(off)
        variance = off.var(axis=0, ddof=1) / n if n > 1 else np.zeros(off.shape[1])
        return float(np.mean(off.mean(axis=0) ** 2 - variance))

    def interval(self, values: Array, others: Others = NO_OTHERS, confidence: float = CONFIDENCE) -> Ends:
        if len(values) < 2:
            return _UNKNOWN
        return intervals.of_squared_distance(self.off(values), confidence)


_UNKNOWN = math.nan, math.nan
MEAN = Expectation()
"""The default statistic of an objective."""
