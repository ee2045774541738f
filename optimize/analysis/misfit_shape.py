"""The shape of a misfit around its minimum: a quadratic form fitted to the designs of a search.

chi^2 is the sum of the squared distances from the measurements, in uncertainties. The designs with chi^2 less
than its minimum + 3.84 form the 95 % likelihood-ratio interval of one parameter. The covariance of the
estimate is twice the inverse of the matrix of second derivatives.

Source: W. H. Press and others, Numerical Recipes, 3rd ed. (2007), sections 15.6 and 15.4.
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
"""Designs with chi^2 less than this above the least are near: 3.5 standard deviations along one gene."""
FAR_CHI2 = 60.0
"""Upper limit of that distance, which is enlarged if few designs are near."""
ONE_GENE_95 = 3.841
"""The 0.95 quantile of chi^2 with one degree of freedom."""
_PER_COEFFICIENT = 2.0
"""Number of near designs wanted for each coefficient of the form; the limit is enlarged beyond NEAR_CHI2 to
reach it."""
_ROUNDS = 6
"""Number of iterations: the form selects the near designs, and is then fitted to them."""
_FLAT = 2e-3
"""Smallest second derivative, chi^2 per squared width of a range. Below it no interval ends within its
range."""
_MODEL_ERROR = 0.1
"""Assumed deviation of chi^2 from its quadratic form at 1 above the minimum; it grows as distance^3."""


@dataclass(frozen=True)
class Evidence:
    """Designs and their chi^2.

    points : shape (designs, genes), of the unit cube.
    chi2 : shape (designs,).
    noise : variance of each chi2 due to the random starts, shape (designs,); 0 if runs have no noise.
    shift : with starts common to all designs, the variance that they add to a measured quantity, in squared
        uncertainties.
    """

    points: Array
    chi2: Array
    noise: Array
    shift: float = 0.0

    @classmethod
    def of_quantities(cls, points: Array, off: Sequence[Array], common: bool) -> Evidence:
        """Return the evidence of all runs: the chi^2 of the means of the quantities over the starts.

        off : for each design the distance of its runs from the measurements, in uncertainties, shape (starts,
            quantities). If every design has one start, the runs are assumed to have no noise.
        common : whether all designs have the same starts.

        The squared distance of a mean over n starts is too large by its variance, s^2 / n, which is
        subtracted.
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
    """A quadratic form of chi^2 on the unit cube.

        chi^2 = least + (u - centre) H (u - centre) / 2

    curvature : the fitted H, without negative eigenvalues.
    covariance : of the estimated genes. It is the sum of three parts: the measurements, 2 / H; the random
        starts; the fit.
    best : the point of least chi^2 within the unit cube.
    designs : number of near designs.
    within : limit of chi^2 above the least for near designs.
    scatter : root mean square deviation of near designs from the form, in chi^2.
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
        """The correlation matrix of the estimates, given that each gene lies within its range.

        Along an undetermined direction rounding errors would correlate all genes. The variance 1/12 of a
        range, added as prior information, limits such a direction.
        """
        values, vectors = np.linalg.eigh(self.covariance)
        covariance = (vectors / (1.0 / np.maximum(values, 1e-12) + 12.0)) @ vectors.T
        deviation = np.sqrt(np.diag(covariance))
        return covariance / np.outer(deviation, deviation)

    def interval(self, gene: int) -> tuple[float, float]:
        """Return the 95 % interval of a gene, 0..1.

        It contains the values at which the least chi^2 over the other genes, within their ranges, is less
        than 3.84 above the overall least.
        """
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
        """Return the least value of the form over the other genes, within their ranges."""
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
        """Return the growth of chi^2 along each principal direction, from the centre of the unit cube to its
        surface, smallest first; and the directions, shape (genes, directions)."""
        values, vectors = np.linalg.eigh(self.curvature)
        length = 0.5 / np.max(np.abs(vectors), axis=0)
        return 0.5 * values * length**2, vectors


def coefficients(genes: int) -> int:
    """Return the number of coefficients of a quadratic form of this number of genes."""
    return (genes + 1) * (genes + 2) // 2


def fit(evidence: Evidence) -> MisfitShape | None:
    """Return the shape of chi^2 around its minimum; None if too few designs are near it."""
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
        # With noise, the designs of least chi^2 are partly lucky; the fitted form decides which designs are
        # near.
        off = evidence.points - shape.centre
        form = 0.5 * np.einsum("ij,jk,ik->i", off, shape.curvature, off)
        at_best = shape.best - shape.centre
        lucky = form - 0.5 * float(at_best @ shape.curvature @ at_best)
        above = np.where(evidence.noise > 0, lucky, evidence.chi2 - evidence.chi2[best])
    return shape


def _near(above: Array, count: int) -> float:
    """Return the limit of chi^2, above the least, up to which designs are used."""
    enough = math.ceil(_PER_COEFFICIENT * count)
    reached = np.sort(above)[min(enough, len(above)) - 1]
    return min(max(NEAR_CHI2, float(reached) * (1 + 1e-12)), FAR_CHI2)


def _fitted(
    evidence: Evidence, near: NDArray[np.bool_], above: Array, centre: Array, within: float
) -> MisfitShape:
    """Return the weighted least-squares fit of the form to the near designs."""
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
    # The error of the minimum is H^-1 times the error of the gradient there, except along flat directions.
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
    """Return the point of the unit cube at which the form is least."""
    if np.all((centre >= 0) & (centre <= 1)):
        return centre
    root = np.linalg.cholesky(curvature).T
    return np.clip(lsq_linear(root, root @ centre, bounds=(0.0, 1.0)).x, 0.0, 1.0)
