"""The response of a measured quantity to the genes: a linear function plus a Gaussian process (kriging).

The response is known near the designs that were run. Elsewhere its variance says how little is known, so
that an extrapolation is not taken for knowledge.

Source: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press (2006), here
GPML: Eq. 2.41 and 2.42, in the limit of a vague prior of the linear function.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from tisim.optimize.surrogate.gaussian_process import GaussianProcess

Array = NDArray[np.float64]

_ROUGHNESS = 0.1
"""Standard deviation, in uncertainties of a measurement, by which a quantity of a single design may deviate
from a smooth response: deviations this small do not matter, and need not be resolved."""


class Response:
    """A quantity as a function of the genes, from designs that were run.

    points : shape (designs, genes), of the unit cube.
    values : the quantity of each design, in uncertainties of its measurement, shape (designs,).
    variance : of the noise in each value, in squared uncertainties, shape (designs,). More noise, and noise
        if this is 0, is estimated from the scatter of the values.
    """

    def __init__(self, points: Array, values: Array, variance: Array) -> None:
        basis = self._basis(points)
        line, *_ = np.linalg.lstsq(basis, values, rcond=None)
        rough = variance + _ROUGHNESS**2
        self._process = process = GaussianProcess(points, values - basis @ line, rough)
        whitened = process.whitened(basis)
        residual = process.whitened((values - basis @ line)[:, None])[:, 0]
        self._normal = cho_factor(whitened.T @ whitened)
        more = cho_solve(self._normal, whitened.T @ residual)
        self._line = line + more
        self._whitened, self._residual = whitened, residual - whitened @ more

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Return mean and variance of the quantity, without noise, at points (m, genes), each (m,)."""
        basis = self._basis(np.atleast_2d(points))
        half = self._process.half_solved(points)
        mean = basis @ self._line + half.T @ self._residual
        left = basis.T - self._whitened.T @ half
        of_line = np.einsum("ij,ij->j", left, cho_solve(self._normal, left))
        of_process = self._process.parameters.signal - np.einsum("ij,ij->j", half, half)
        return mean, self._process.scale**2 * (np.maximum(of_process, 0.0) + of_line)

    def gradients(self, point: Array) -> tuple[Array, Array]:
        """Return the gradients of mean and variance at a point, each (genes,)."""
        slopes = self._process.whitened(self._process.covariance_gradient(point))
        half = self._process.half_solved(point)[:, 0]
        mean = self._line[1:] + slopes.T @ self._residual
        left = self._basis(point[None])[0] - self._whitened.T @ half
        of_left = np.vstack([np.zeros(len(point)), np.eye(len(point))]) - self._whitened.T @ slopes
        of_line = 2.0 * cho_solve(self._normal, left) @ of_left
        return mean, self._process.scale**2 * (of_line - 2.0 * half @ slopes)

    @staticmethod
    def _basis(points: Array) -> Array:
        return np.column_stack([np.ones(len(points)), points])
