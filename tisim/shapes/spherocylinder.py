"""Spherocylinders as shapes of particles."""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import model_validator

from tisim.components.component import parameter
from tisim.shapes.particle_shape import ParticleShape, check_thickness


class SpherocylinderShape(ParticleShape):
    """A cylinder along z between two hemispheres of its diameter: all points within R = D/2 of a segment of
    length L.

        Lambda = (L + D)/D                                                                  (2.1)
        V = pi R^2 (4/3 R + L)                                                              (2.2)
        I_x/m = I_y/m = (5 L^3 + 20 L^2 R + 45 L R^2 + 32 R^3) / (20 (3 L + 4 R))           (2.3)
        I_z/m = (15 L R^2 + 16 R^3) / (10 (3 L + 4 R))

    Lambda is the aspect ratio. Source: R. J. Baars, thesis (Utrecht University, 2016), chapter 2.
    """

    length: float = parameter("m", "length L of the cylinder, without its hemispheres", examples=[4e-3], ge=0)
    diameter: float = parameter("m", "diameter D", examples=[1e-3], gt=0)

    @model_validator(mode="after")
    def _is_not_too_thin(self) -> Self:
        check_thickness(self)
        return self

    @classmethod
    def of(cls, shape: ParticleShape) -> Self | None:
        """Return the rod with the form of a shape, of length 0 for a sphere; None if there is none."""
        rod = shape.rod()
        return None if rod is None else cls(length=2 * rod[0], diameter=2 * rod[1])

    @property
    def radius(self) -> float:
        """Return the radius (m)."""
        return self.diameter / 2

    @property
    def aspect_ratio(self) -> float:
        """Return the ratio of the whole length to the diameter (2.1)."""
        return self.length / self.diameter + 1

    def volume(self) -> float:
        return float(np.pi * self.radius**2 * (4 / 3 * self.radius + self.length))

    def moments(self) -> np.ndarray:
        l, r = self.length, self.radius  # noqa: E741
        across = (5 * l**3 + 20 * l**2 * r + 45 * l * r**2 + 32 * r**3) / (20 * (3 * l + 4 * r))
        return np.array([across, across, (15 * l * r**2 + 16 * r**3) / (10 * (3 * l + 4 * r))])

    def half_extents(self) -> np.ndarray:
        return np.array([self.radius, self.radius, self.bounding_radius()])

    def bounding_radius(self) -> float:
        return self.length / 2 + self.radius

    def contact_radius(self) -> float:
        # The sphere that is swept along the segment touches at the same point.
        return self.radius

    def support(self, direction: np.ndarray) -> np.ndarray:
        n = np.asarray(direction, float)
        farthest: np.ndarray = self.radius * n / np.linalg.norm(n, axis=-1, keepdims=True)
        farthest[..., 2] += self.length / 2 * np.sign(n[..., 2])
        return farthest

    def contains(self, points: np.ndarray) -> np.ndarray:
        away = np.abs(np.asarray(points, float))
        away[..., 2] = np.maximum(away[..., 2] - self.length / 2, 0)
        within: np.ndarray = np.linalg.norm(away, axis=-1) <= self.radius
        return within

    def rod(self) -> tuple[float, float]:
        return self.length / 2, self.radius
