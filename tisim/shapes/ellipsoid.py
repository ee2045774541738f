"""Ellipsoids as shapes of particles."""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import model_validator

from tisim.components.component import Vector, parameter
from tisim.shapes.particle_shape import ParticleShape, check_thickness, positive


class EllipsoidShape(ParticleShape):
    """An ellipsoid, the superquadric of exponents 2.

        (x/a_1)^2 + (y/a_2)^2 + (z/a_3)^2 = 1
        I_x/m = (a_2^2 + a_3^2)/5

    and so on for y and z.
    """

    semi_axes: Vector = parameter("m", "semi-axes a_1, a_2 and a_3", examples=[(1e-3, 1e-3, 2e-3)])

    @model_validator(mode="after")
    def _axes_are_positive(self) -> Self:
        positive(f"{self.label}.semi_axes", self.semi_axes)
        check_thickness(self)
        return self

    def volume(self) -> float:
        return float(4 / 3 * np.pi * np.prod(self.semi_axes))

    def moments(self) -> np.ndarray:
        square = np.square(self.semi_axes)
        # Without differences, which would cancel for thin shapes.
        moments: np.ndarray = (np.roll(square, -1) + np.roll(square, 1)) / 5
        return moments

    def half_extents(self) -> np.ndarray:
        return np.array(self.semi_axes)

    def bounding_radius(self) -> float:
        return max(self.semi_axes)

    def support(self, direction: np.ndarray) -> np.ndarray:
        scaled = self.half_extents() * direction
        farthest: np.ndarray = self.half_extents() * scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
        return farthest

    def contains(self, points: np.ndarray) -> np.ndarray:
        within: np.ndarray = np.linalg.norm(points / self.half_extents(), axis=-1) <= 1
        return within

    def superquadric(self) -> tuple[Vector, Vector]:
        return self.semi_axes, (2.0, 2.0, 2.0)
