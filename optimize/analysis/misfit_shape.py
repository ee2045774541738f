"""The shape of a misfit around its least value: a quadratic form through the designs that a search has run.

With chi^2 the sum of the squared distances from what was measured, in uncertainties, the designs with chi^2
less than its minimum + 3.84 have 95 % of the likelihood ratio of one parameter (W. H. Press and others,
Numerical Recipes, 3rd ed. (2007), section 15.6), and the covariance of the estimate is twice the inverse of
the matrix of second derivatives (section 15.4).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, lsq_linear

Array = NDArray[np.float64]

NEAR_CHI2 = 12.0
"""Designs whose chi^2 is less than this above the least are near: 3.5 standard deviations along one gene."""
FAR_CHI2 = 60.0
"""What near may be at most, where few designs are."""
ONE_GENE_95 = 3.841
"""The 0.95 quantile of chi^2 of one degree of freedom."""
_PER_COEFFICIENT = 2.0
"""Designs that are wanted for each coefficient of the form; with fewer within NEAR_CHI2 others are in it."""
_ROUNDS = 6
"""Times that the near designs are chosen by the form and the form is fitted to them."""
_FLAT = 2e-3
"""Least second derivative, chi^2 per squared width of a range; with less no range ends anything."""
_MODEL_ERROR = 0.1
"""How far chi^2 is taken to be from its quadratic form at 1 above the minimum; it grows as distance^3."""


@dataclass(frozen=True)
class Evidence:
    """Designs and their chi^2.

    points : shape (designs, genes), of the unit cube. chi2 : shape (designs,). noise : the variance of each
    chi2 that random starts have left in it, shape (designs,), 0 where runs have no noise. shift : by random
    starts that are the same for all designs, the variance of what they add to a measured quantity, in squared
    uncertainties.
    """

    points: Array
    chi2: Array
    noise: Array
    shift: float = 0.0

    @classmethod
    def of_quantities(cls, points: Array, off: Sequence[Array], common: bool) -> Evidence:
        """Return the evidence of the quantities of all runs: the chi^2 of their means over the starts.

        off : of each design how far its runs are from what was measured, in uncertainties, shape (starts,
        quantities); of designs with one start that have no other the runs are taken to have no noise.
        common : whether all designs have the same starts. The squared distance of a mean over n starts is too
        large by its variance, s^2 / n, which is subtracted.
        """
        starts = np.array([len(one) for one in off], dtype=float)[:, None]
        means = np.array([one.mean(axis=0) for one in off])
        squares = np.array([((one - one.mean(axis=0)) ** 2).sum(axis=0) for one in off])
        freedom = np.maximum(starts - 1.0, 0.0)
        pooled = squares.sum(axis=0) / max(freedom.sum(), 1.0)
        own = np.where(starts > 1, squares / np.maximum(freedom, 1.0), pooled) / starts
        chi2 = (means**2 - own).sum(axis=1)
        noise = (4.0 * means**2 * pooled / starts + 2.0 * (pooled / starts) ** 2).sum(axis=1)
        shift = float(pooled.mean() / np.median(starts)) if common else 0.0
        return cls(points, chi2, noise, shift)


@dataclass(frozen=True)
class MisfitShape:
    """chi^2 = least + (u - centre) H (u - centre) / 2 for u of the unit cube.

    curvature : H as it was fitted, without negative eigenvalues. covariance : of the estimate of the genes:
    of what was measured, 2 / H, of the random starts, and of the fit. best : the point of least chi^2 within
    the unit cube. designs : how many are near. within : chi^2 above the least that is called near. scatter :
    the root of the mean square by which near designs are off the form, chi^2.
    """

    centre: Array
    least: float
    curvature: Array
    covariance: Array
    best: Array
    designs: int
    within: float
    scatter: float

    @property
    def correlation(self) -> Array:
        """The correlation matrix of the estimates, each known to be within its range.

        Along a direction that is not told rounding would tie all genes; a range has a variance of 1/12, and
        ends such a direction.
        """
        values, vectors = np.linalg.eigh(self.covariance)
        covariance = (vectors / (1.0 / np.maximum(values, 1e-12) + 12.0)) @ vectors.T
        deviation = np.sqrt(np.diag(covariance))
        return covariance / np.outer(deviation, deviation)

    def interval(self, gene: int) -> tuple[float, float]:
        """Return the 95 % interval of a gene, 0..1: where the least chi^2 of all designs with that value is
        less than 3.84 above the least of all. Other genes are kept within their ranges."""
        half = math.sqrt(ONE_GENE_95 * self.covariance[gene, gene])
        reach = np.sqrt(ONE_GENE_95 * np.diag(self.covariance))
        if np.all(self.centre - reach >= 0) and np.all(self.centre + reach <= 1):
            return float(self.centre[gene] - half), float(self.centre[gene] + half)
        goal = self._profile(gene, float(self.best[gene])) + ONE_GENE_95
        ends = []
        for end in (0.0, 1.0):
            inside = self._profile(gene, end) <= goal
            at = end if inside else brentq(
                lambda value: self._profile(gene, value) - goal, end, float(self.best[gene]), xtol=1e-6
            )  # fmt: skip
            ends.append(float(at))
        return ends[0], ends[1]

    def _profile(self, gene: int, value: float) -> float:
        """Return the least of the form over the other genes, within their ranges."""
        root = self._root
        others = np.arange(len(self.centre)) != gene
        target = root @ self.centre - root[:, gene] * value
        if not np.any(others):
            return float(target @ target)
        found = lsq_linear(root[:, others], target, bounds=(0.0, 1.0))
        return float(2.0 * found.cost)

    @property
    def _root(self) -> Array:
        """R with R.T @ R the inverse of the covariance."""
        values, vectors = np.linalg.eigh(self.covariance)
        return np.asarray((vectors / np.sqrt(np.maximum(values, 1e-12))).T)

    def growth(self) -> tuple[Array, Array]:
        """Return by how much chi^2 grows along each principal direction from the middle of the unit cube to
        where it leaves it, least first, and the directions, shape (genes, directions)."""
        values, vectors = np.linalg.eigh(self.curvature)
        length = 0.5 / np.max(np.abs(vectors), axis=0)
        return 0.5 * values * length**2, vectors


def coefficients(genes: int) -> int:
    """Return how many coefficients the quadratic form of so many genes has."""
    return (genes + 1) * (genes + 2) // 2


def fit(evidence: Evidence) -> MisfitShape | None:
    """Return the shape of chi^2 around its least value; None where too few designs are near it."""
    genes = evidence.points.shape[1]
    wanted = coefficients(genes) + 2
    best = int(np.argmin(evidence.chi2))
    above = evidence.chi2 - evidence.chi2[best]
    centre, shape = evidence.points[best], None
    for _ in range(_ROUNDS):
        within = _near(above, coefficients(genes))
        near = above < within
        if near.sum() < wanted:
            return shape
        shape = _fitted(evidence, near, np.maximum(above, 0.0), centre, within)
        centre = shape.best
        # Of designs with noise those with the least chi^2 are lucky; the form tells which are near.
        off = evidence.points - shape.centre
        form = 0.5 * np.einsum("ij,jk,ik->i", off, shape.curvature, off)
        at_best = shape.best - shape.centre
        lucky = form - 0.5 * float(at_best @ shape.curvature @ at_best)
        above = np.where(evidence.noise > 0, lucky, evidence.chi2 - evidence.chi2[best])
    return shape


def _near(above: Array, count: int) -> float:
    """Return how far above the least chi^2 designs are taken in."""
    enough = math.ceil(_PER_COEFFICIENT * count)
    reached = np.sort(above)[min(enough, len(above)) - 1]
    return min(max(NEAR_CHI2, float(reached) * (1 + 1e-12)), FAR_CHI2)


def _fitted(
    evidence: Evidence, near: NDArray[np.bool_], above: Array, centre: Array, within: float
) -> MisfitShape:
    """Return the form of least weighted squares through the near designs."""
    points, chi2, noise = evidence.points[near], evidence.chi2[near], evidence.noise[near]
    genes = points.shape[1]
    scale = np.maximum(np.std(points - centre, axis=0), 1e-9)
    z = (points - centre) / scale
    row, column = np.triu_indices(genes)
    columns = np.column_stack([np.ones(len(z)), z, z[:, row] * z[:, column]])
    variance = noise + _MODEL_ERROR**2 * np.maximum(above[near], 0.1) ** 3 + 1e-4
    heavy = 1.0 / np.sqrt(variance)
    solution, *_ = np.linalg.lstsq(columns * heavy[:, None], chi2 * heavy, rcond=None)
    residual = chi2 - columns @ solution
    freedom = max(len(z) - columns.shape[1], 1)
    excess = float(np.sum((residual * heavy) ** 2)) / freedom
    normal = np.linalg.pinv((columns * heavy[:, None]).T @ (columns * heavy[:, None]))
    matrix = np.zeros((genes, genes))
    matrix[row, column] += solution[1 + genes :]
    matrix = (matrix + matrix.T) / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(matrix)
    values = np.maximum(values, _FLAT)
    curvature = (vectors * values) @ vectors.T
    inverse = (vectors / values) @ vectors.T
    gradient = solution[1 : 1 + genes] / scale
    middle = centre - inverse @ gradient
    best = _within_cube(middle, curvature)
    at = (best - centre) / scale
    least = float(np.concatenate([[1.0], at, at[row] * at[column]]) @ solution)
    # The error of the minimum is H^-1 times that of the slope there, but for flat directions.
    slope = np.zeros((genes, columns.shape[1]))
    slope[:, 1 : 1 + genes] = np.eye(genes)
    for k, (i, j) in enumerate(zip(row, column, strict=True)):
        slope[i, 1 + genes + k] += at[j]
        slope[j, 1 + genes + k] += at[i]
    slope /= scale[:, None]
    of_slope = slope @ normal @ slope.T * (max(excess, 1.0) if np.any(noise) else excess)
    steep = (vectors * np.where(values > _FLAT, 1.0 / values, 0.0)) @ vectors.T
    covariance = 2.0 * inverse * (1.0 + evidence.shift) + steep @ of_slope @ steep
    covariance = 0.5 * (covariance + covariance.T)
    scatter = float(np.sqrt(np.mean(residual**2)))
    return MisfitShape(middle, least, curvature, covariance, best, int(near.sum()), within, scatter)


def _within_cube(centre: Array, curvature: Array) -> Array:
    """Return the point of the unit cube where the form is least."""
    if np.all((centre >= 0) & (centre <= 1)):
        return centre
    root = np.linalg.cholesky(curvature).T
    return np.clip(lsq_linear(root, root @ centre, bounds=(0.0, 1.0)).x, 0.0, 1.0)
