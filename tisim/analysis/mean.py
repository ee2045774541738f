"""Means over random runs, with their confidence intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tisim.errors import must
from tisim.numerics.statistics import half_width


@dataclass(frozen=True)
class Mean:
    """The mean of independent runs, and the half-width of its 95 % confidence interval.

    For results that differ only in their seeds,

        Mean.of([result.measures["captured"] for result in results])

    prints as "0.483 ± 0.082". value, half : in the unit of the quantity; ``half`` is infinite for a single
    run.
    """

    value: float
    half: float

    @classmethod
    def of(cls, runs: ArrayLike) -> Mean:
        """Return the mean of a quantity over runs, given one number per run, with its interval from Student's
        t.

        InputError unless there is at least one number and all are finite.
        """
        try:
            values = np.asarray(runs, float)
        except (TypeError, ValueError):
            values = np.zeros((0,))
        sound = values.ndim == 1 and len(values) > 0 and bool(np.isfinite(values).all())
        must(sound, "runs", "a list of finite numbers, one for each run", runs)
        return cls(float(np.mean(values)), float(half_width(values)))

    def minus(self, other: Mean) -> Mean:
        """Return the difference of two independent means."""
        return Mean(self.value - other.value, float(np.hypot(self.half, other.half)))

    def over(self, other: Mean) -> Mean:
        """Return the ratio of two independent means, to first order in their errors."""
        ratio = self.value / other.value
        return Mean(ratio, abs(ratio) * float(np.hypot(self.half / self.value, other.half / other.value)))

    def __str__(self) -> str:
        """Return the mean and the half-width as text, with two digits of the half-width and the same
        decimals."""
        if not (np.isfinite([self.value, self.half]).all() and self.half > 0):
            return f"{self.value:.4g} ± {self.half:.2g}"
        # Digits of the rounded half-width, which may have one more digit before the decimal point.
        digits = 1 - int(np.floor(np.log10(float(f"{self.half:.1e}"))))
        if -4 < digits < 6:
            value, half = (f"{round(one, digits):.{max(digits, 0)}f}" for one in (self.value, self.half))
            return f"{value} ± {half}"
        beyond = int(np.floor(np.log10(abs(self.value)))) + digits if self.value else 0
        return f"{self.value:.{max(beyond + 1, 1)}g} ± {self.half:.2g}"
