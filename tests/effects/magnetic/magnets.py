"""Shared by tests of magnetic effects: a field, moments and the field of dipoles, in NumPy."""

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.sources import Source
from tisim.sources.base import parameter

MU_0 = 1.25663706127e-6
"""N/A^2 (CODATA 2022)."""
K_B = 1.380649e-23
"""J/K."""


class Quadrupole(Source):
    """B = C + S (y, x, z^2). If the components of S differ, its gradient is not symmetric."""

    quantity = "magnetic_flux_density"
    constant: Vector = parameter("T", "constant")
    scale: Vector = parameter("T/m", "scale")

    @ti.func
    def value(self, w, r, t):
        return self.constant(w) + self.scale(w) * ti.Vector([r[1], r[0], r[2] * r[2]])

    @ti.func
    def gradient(self, w, r, t):
        a = self.scale(w)
        return ti.Matrix([[0.0, a[0], 0.0], [a[1], 0.0, 0.0], [0.0, 0.0, 2.0 * a[2] * r[2]]])


def flux_density(effects, r):
    """B of a Quadrupole, the first of the effects, and of a uniform MagneticField, the second; at
    r, (n, 3)."""
    field, uniform = effects[:2]
    b = np.array(field.constant) + np.array(uniform.constant)
    return b + np.array(field.scale) * np.stack([r[:, 1], r[:, 0], r[:, 2] ** 2], axis=1)


def gradient(effects, r):
    """[a, b] the derivative of component a of that field along axis b; (n, 3, 3)."""
    a, zero = effects[0].scale, 0.0 * r[:, 0]
    rows = [[zero, a[0] + zero, zero], [a[1] + zero, zero, zero], [zero, zero, 2 * a[2] * r[:, 2]]]
    return np.array(rows).transpose(2, 0, 1)


def dipole_field(r, side=None):
    """[i, j] the matrix that gives the field (T) at i of a moment at j; for nearest images in a box."""
    d = r[None] - r[:, None]
    if side is not None:
        d -= side * np.round(d / side)
    distance = np.linalg.norm(d, axis=2) + np.eye(len(r))
    n = d / distance[..., None]
    field = 3 * n[..., None] * n[..., None, :] - np.eye(3)
    field *= (MU_0 / (4 * np.pi) * (1 - np.eye(len(r))) / distance**3)[..., None, None]
    return field
