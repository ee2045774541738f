"""The slow flow that forces on the faces of a periodic staggered grid cause, by Fourier transforms."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import fft


class StokesOperator:
    """The flow of a fluid of unit viscosity that forces on faces cause in a periodic box; its mean is 0.

        L u - grad p + f = 0,    div u = 0

    L is the second difference along all axes, and grad and div are the differences of neighbouring cells and
    faces. The velocity is free of divergence in every cell, to rounding. Fourier transforms solve the
    equations exactly; the mean of f has no effect.

    shape : cells along each axis. spacing : sides of a cell, shape (3,).

    Source: F. H. Harlow, J. E. Welch, Phys. Fluids 8 (1965) 2182, for the staggered grid.
    """

    def __init__(self, shape: tuple[int, int, int], spacing: np.ndarray, threads: int = 1) -> None:
        self.shape, self.spacing, self.threads = shape, spacing, threads
        self._difference, total = [], np.zeros(1)
        for axis, n in enumerate(shape):
            waves = fft.rfftfreq(n) if axis == 2 else fft.fftfreq(n)
            symbol = (np.exp(2j * np.pi * waves) - 1) / spacing[axis]
            one = np.expand_dims(symbol, tuple(b for b in range(3) if b != axis))
            self._difference.append(one)
            total = total + np.abs(one) ** 2
        total[0, 0, 0] = np.inf
        self._inverse = 1 / total

    def velocity(self, force: np.ndarray) -> np.ndarray:
        """Return u caused by f; shape (3, nx, ny, nz) each."""
        waves = self._transform(force)
        pressed = self._divergence(waves)
        pressed *= self._inverse
        for wave, one in zip(waves, self._difference, strict=True):
            wave -= np.conj(one) * pressed
            wave *= self._inverse
        return np.asarray(
            fft.irfftn(waves, s=self.shape, axes=(1, 2, 3), workers=self.threads, overwrite_x=True)
        )

    def pressure(self, force: np.ndarray) -> np.ndarray:
        """Return p in the cells; shape (nx, ny, nz)."""
        wave = -self._divergence(self._transform(force)) * self._inverse
        return np.asarray(fft.irfftn(wave, s=self.shape, workers=self.threads))

    def divergence(self, velocity: np.ndarray) -> np.ndarray:
        """Return div u in the cells; shape (nx, ny, nz)."""
        return np.asarray(
            sum((np.roll(u, -1, a) - u) / self.spacing[a] for a, u in enumerate(velocity)), float
        )

    def second_difference(self, velocity: np.ndarray) -> np.ndarray:
        """Return L u; shape (3, nx, ny, nz)."""
        changes = (
            (np.roll(velocity, 1, a + 1) - 2 * velocity + np.roll(velocity, -1, a + 1)) / self.spacing[a] ** 2
            for a in range(3)
        )
        return np.asarray(sum(changes), float)

    @cached_property
    def own(self) -> np.ndarray:
        """Return the velocity at a face that a unit force along each axis at this face causes, shape (3,)."""
        n = self.shape[2]
        twice = np.where((np.arange(n // 2 + 1) == 0) | (2 * np.arange(n // 2 + 1) == n), 1.0, 2.0)
        across = [1 - np.abs(one) ** 2 * self._inverse for one in self._difference]
        return np.array([(twice * self._inverse * part).sum() for part in across]) / np.prod(self.shape)

    def _transform(self, force: np.ndarray) -> np.ndarray:
        return np.asarray(fft.rfftn(force, axes=(1, 2, 3), workers=self.threads))

    def _divergence(self, waves: np.ndarray) -> np.ndarray:
        x, y, z = (wave * one for wave, one in zip(waves, self._difference, strict=True))
        x += y
        x += z
        return np.asarray(x)
