"""The energy of magnetised bodies in a uniform field and in the fields of each other, and its minimisation.

With the magnetisations M_i, volumes V_i, demagnetising tensors N_ij and the uniform field H_0, the energy is

    E / mu_0 = sum_ij V_i M_i.N_ij M_j / 2 + sum_i V_i (M_i^2 / (2 chi) - M_i.H_0)

The term in chi, the work to magnetise a linear material, is absent for bodies that are always saturated.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.constants import mu_0

from tisim.sources.magnetic import stoner_wohlfarth
from tisim.sources.magnetic.cylinder_body import Cylinder

POWER_STEPS = 40
"""Steps of the power iteration for the largest eigenvalue of the tensors."""


class MagneticEnergy:
    """The energy of cylinders as a function of their magnetisations.

    magnetisation : A/m, shape (n, 3), where the iteration has come to. cylinders : their shapes. tensors :
    N_ij, shape (n, 3, n, 3). field : H_0 (A/m), shape (3,). limit : saturation magnetisations (A/m), shape
    (n,). kept : whether a magnetisation is not changed, shape (n,).
    """

    def __init__(
        self,
        cylinders: Sequence[Cylinder],
        tensors: np.ndarray,
        field: np.ndarray,
        limit: np.ndarray,
        kept: np.ndarray,
    ) -> None:
        n = len(cylinders)
        self.cylinders, self.field, self.limit, self.kept = cylinders, field, limit, kept
        # In units of the root of the volume the energy has a symmetric matrix with eigenvalues from 0 to 1.
        root = np.sqrt([one.radius**2 * one.length for one in cylinders])
        self.root = root[:, None] / root.max()
        scale = np.repeat(self.root[:, 0], 3)
        self.matrix = tensors.reshape(3 * n, 3 * n) * (scale[:, None] / scale)
        self.matrix = 0.5 * (self.matrix + self.matrix.T)
        self.magnetisation = np.array([one.magnetisation for one in cylinders], float)
        self.magnetisation[~kept] = 0.0
        self._before, self._momentum = self.magnetisation, 1.0
        self._largest = self._largest_eigenvalue()

    def own_field(self, magnetisation: np.ndarray) -> np.ndarray:
        """Return the mean field (A/m) of all bodies in each, shape (n, 3)."""
        product = self.matrix @ (self.root * magnetisation).ravel()
        return -product.reshape(-1, 3) / self.root

    def _largest_eigenvalue(self) -> float:
        vector = np.random.default_rng(1).normal(size=self.magnetisation.shape)
        size = 1.0
        for _ in range(POWER_STEPS):
            vector = self.own_field(vector)
            size = float(np.linalg.norm(self.root * vector))
            vector /= size
        return max(1.0, 1.1 * size)

    def imbalance(self, stiffness: float | None) -> float:
        """Return the largest field that would still change a magnetisation, relative to the largest of the
        uniform field and the fields of the bodies.

        stiffness : 1 / chi; None for bodies that are always saturated.
        """
        own, m = self.own_field(self.magnetisation), self.magnetisation
        drive = self.field + own - (0.0 if stiffness is None else stiffness) * m
        size = np.linalg.norm(m, axis=1)
        unit = m / np.where(size > 0, size, 1.0)[:, None]
        along = np.einsum("ia,ia->i", drive, unit)
        # A saturated magnetisation can turn, and shorten if it is soft, but not grow.
        held = (
            np.full(len(m), True) if stiffness is None else (size >= (1 - 1e-12) * self.limit) & (along > 0)
        )
        drive = drive - np.where(held, along, 0.0)[:, None] * unit
        largest = max(np.linalg.norm(self.field), np.linalg.norm(own, axis=1).max())
        left = np.linalg.norm(drive, axis=1)[~self.kept].max(initial=0.0)
        return float(left / largest) if largest > 0 else 0.0

    def minimise(self, stiffness: float | None, tolerance: float, iterations: int) -> tuple[int, float]:
        """Iterate until the imbalance is at most the tolerance; return the number of iterations, at most
        ``iterations``, and the imbalance.

        stiffness : 1 / chi; None for bodies that are always saturated.
        """
        count, imbalance = 0, np.inf
        while count < iterations and not imbalance <= tolerance:
            if stiffness is None:
                self.rotate()
            else:
                self.descend(stiffness)
            count, imbalance = count + 1, self.imbalance(stiffness)
        return count, imbalance

    def saturate(self, wholes: Sequence[Cylinder]) -> None:
        """Start with the magnetisations that the cylinders would have alone in the uniform field.

        wholes : the cylinders, each of which has an equal number of pieces.
        """
        pieces = len(self.cylinders) // len(wholes)
        for k, one in enumerate(wholes):
            own = slice(k * pieces, (k + 1) * pieces)
            if not self.kept[own][0]:
                self.magnetisation[own] = self._alone(one, self.limit[own][0], self.field)

    def rotate(self) -> None:
        """Turn each saturated magnetisation, one after another, to the minimum of its energy."""
        for i in np.flatnonzero(~self.kept):
            row = self.matrix[3 * i : 3 * i + 3]
            own = row[:, 3 * i : 3 * i + 3] @ self.magnetisation[i]
            others = row @ (self.root * self.magnetisation).ravel() / self.root[i] - own
            self.magnetisation[i] = self._alone(self.cylinders[int(i)], self.limit[i], self.field - others)

    @staticmethod
    def _alone(one: Cylinder, limit: float, field: np.ndarray) -> np.ndarray:
        h = float(mu_0 * field[0]), float(mu_0 * field[1]), float(mu_0 * field[2])
        return np.array(stoner_wohlfarth.magnetisation(one.axis, one.radius, one.length, float(limit), h))

    def descend(self, stiffness: float) -> None:
        """Move all soft magnetisations by one step of the accelerated projected gradient.

        stiffness : 1 / chi.
        """
        m, before = self.magnetisation, self._before
        grown = 0.5 * (1 + np.sqrt(1 + 4 * self._momentum**2))
        ahead = m + (self._momentum - 1) / grown * (m - before)
        drive = self.field + self.own_field(ahead) - stiffness * ahead
        moved = ahead + drive / (self._largest + stiffness)
        size = np.linalg.norm(moved, axis=1)
        moved *= np.minimum(1.0, self.limit / np.maximum(size, np.finfo(float).tiny))[:, None]
        moved[self.kept] = m[self.kept]
        # If the step turns back, the momentum is lost.
        weight = self.root**2
        back = float((weight * (ahead - moved) * (moved - m)).sum()) > 0
        self.magnetisation, self._before = moved, m
        self._momentum = 1.0 if back else float(grown)
