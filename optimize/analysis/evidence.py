"""The evidence of a calibration: the designs of a search, and their distances from the measurements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEAR_CHI2 = 12.0
"""Designs with chi^2 less than this above the least are near: 3.5 standard deviations along one gene."""
FAR_CHI2 = 60.0
"""Upper limit of that distance, which is enlarged if few designs are near."""
_PER_COEFFICIENT = 2.0
"""Number of near designs wanted for each coefficient of a quadratic form; the limit is enlarged beyond
NEAR_CHI2 to reach it."""


@dataclass(frozen=True)
class Evidence:
    """Designs, and the distances of their quantities from the measurements.

    points : shape (designs, genes), of the unit cube.
    off : means over the starts of each design, in uncertainties, shape (designs, quantities).
    variance : of each mean due to the random starts, in squared uncertainties, the same shape; 0 if runs have
        no noise.
    shift : with starts common to all designs, the variance that they add to each measured quantity, shape
        (quantities,); else 0.
    chi2 : the sum of the squares of ``off``, without the part that is due to the random starts.
    """

    points: Array
    off: Array
    variance: Array
    shift: Array
    chi2: Array

    @classmethod
    def of_quantities(cls, points: Array, off: Sequence[Array], common: bool) -> Evidence:
        """Return the evidence of all runs.

        off : for each design the distance of its runs from the measurements, in uncertainties, shape (starts,
            quantities).
        common : whether all designs have the same starts.

        The squared distance of a mean over n starts is too large by its variance, s^2 / n, which is
        subtracted. Common starts move the quantities of all designs alike, by a random amount; differences
        between designs are then free of noise.
        """
        starts = np.array([len(one) for one in off], dtype=float)[:, None]
        means = np.array([one.mean(axis=0) for one in off])
        squares = np.array([((one - one.mean(axis=0)) ** 2).sum(axis=0) for one in off])
        freedom = np.maximum(starts - 1.0, 0.0)
        pooled = squares.sum(axis=0) / max(freedom.sum(), 1.0)
        own = np.where(starts > 1, squares / np.maximum(freedom, 1.0), pooled) / starts
        chi2 = (means**2 - own).sum(axis=1)
        if common:
            return cls(points, means, np.zeros_like(means), pooled / np.median(starts), chi2)
        return cls(points, means, pooled / starts, np.zeros_like(pooled), chi2)

    def of(self, chosen: NDArray[np.bool_], genes: Sequence[int]) -> Evidence:
        """Return the evidence of chosen designs and genes."""
        off, variance, chi2 = self.off[chosen], self.variance[chosen], self.chi2[chosen]
        return Evidence(self.points[chosen][:, genes], off, variance, self.shift, chi2)

    @property
    def missing(self) -> int:
        """The number of further designs near the least misfit that are needed for a likelihood; 0 if it has
        enough."""
        above = np.sort(self.chi2 - self.chi2.min())
        count = coefficients(self.points.shape[1])
        enough = math.ceil(_PER_COEFFICIENT * count)
        within = min(max(NEAR_CHI2, float(above[min(enough, len(above)) - 1]) * (1 + 1e-12)), FAR_CHI2)
        return 0 if np.sum(above < within) >= count + 2 else enough - int(np.sum(above < NEAR_CHI2))


def coefficients(genes: int) -> int:
    """Return the number of coefficients of a quadratic form of this number of genes."""
    return (genes + 1) * (genes + 2) // 2
