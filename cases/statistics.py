"""Means of random runs, how well they are known, and what may be said of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from tisim.numerics.statistics import CONFIDENCE, half_width


@dataclass(frozen=True)
class Mean:
    """The mean of independent runs, and half the width of its confidence interval (CONFIDENCE)."""

    value: float
    half: float

    @classmethod
    def of(cls, runs: ArrayLike) -> Mean:
        """Return the mean of two runs or more, its interval by Student's t."""
        return cls(float(np.mean(np.asarray(runs, float))), float(half_width(runs)))

    def minus(self, other: Mean) -> Mean:
        """Return the difference of two independent means."""
        return Mean(self.value - other.value, float(np.hypot(self.half, other.half)))

    def over(self, other: Mean) -> Mean:
        """Return the ratio of two independent means, to first order in their errors."""
        ratio = self.value / other.value
        return Mean(ratio, abs(ratio) * float(np.hypot(self.half / self.value, other.half / other.value)))

    def __str__(self) -> str:
        """Return it with two digits of the interval, and none of the mean that are beyond those."""
        if not (np.isfinite([self.value, self.half]).all() and self.half > 0):
            return f"{self.value:.4g} ± {self.half:.2g}"
        # Of the interval as it is rounded, which may have a digit more before the point.
        digits = 1 - int(np.floor(np.log10(float(f"{self.half:.1e}"))))
        if -4 < digits < 6:
            value, half = (f"{round(one, digits):.{max(digits, 0)}f}" for one in (self.value, self.half))
            return f"{value} ± {half}"
        beyond = int(np.floor(np.log10(abs(self.value)))) + digits if self.value else 0
        return f"{self.value:.{max(beyond + 1, 1)}g} ± {self.half:.2g}"


@dataclass(frozen=True)
class Claim:
    """A statement about random runs: right when all of the confidence interval lies in least..most."""

    name: str
    mean: Mean
    least: float = -np.inf
    most: float = np.inf

    @property
    def ok(self) -> bool:
        return (
            self.least <= self.mean.value - self.mean.half and self.mean.value + self.mean.half <= self.most
        )

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Measured, expected, off by, allowed; for people."""
        bounds = [f"above {self.least:.4g}"] * bool(np.isfinite(self.least))
        bounds += [f"below {self.most:.4g}"] * bool(np.isfinite(self.most))
        return str(self.mean), ", ".join(bounds), "", f"{CONFIDENCE:.0%} confidence"


@dataclass(frozen=True)
class Shown:
    """A number that is shown beside what is said of it elsewhere, and not judged."""

    name: str
    value: float | Mean
    beside: str = ""
    ok: ClassVar[None] = None

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """The number, and what it is shown beside; for people."""
        return str(self.value) if isinstance(self.value, Mean) else f"{self.value:.4g}", self.beside, "", ""
