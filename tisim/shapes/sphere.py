"""Spheres as shapes of particles."""

from __future__ import annotations

import numpy as np

from tisim.components.component import Vector, parameter
from tisim.shapes.particle_shape import ParticleShape


class SphereShape(ParticleShape):
    """A sphere: the rod without a segment, and the superquadric of equal semi-axes and exponents 2."""

    diameter: float = parameter("m", "diameter D", examples=[1e-3], gt=0)

    @property
    def radius(self) -> float:
        """Return the radius (m)."""
        return self.diameter / 2

    def volume(self) -> float:
        return float(4 / 3 * np.pi * self.radius**3)

    def moments(self) -> np.ndarray:
        return np.full(3, 0.4 * self.radius**2)

    def half_extents(self) -> np.ndarray:
        return np.full(3, self.radius)

    def bounding_radius(self) -> float:
        return self.radius

    def support(self, direction: np.ndarray) -> np.ndarray:
        n = np.asarray(direction, float)
        farthest: np.ndarray = self.radius * n / np.linalg.norm(n, axis=-1, keepdims=True)
        return farthest

    def contains(self, points: np.ndarray) -> np.ndarray:
        within: np.ndarray = np.linalg.norm(points, axis=-1) <= self.radius
        return within

    def rod(self) -> tuple[float, float]:
        return 0.0, self.radius

    def superquadric(self) -> tuple[Vector, Vector]:
        return (self.radius, self.radius, self.radius), (2.0, 2.0, 2.0)
