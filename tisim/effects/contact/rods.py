"""Particles that are rods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import Shaped
from tisim.numerics.vectors import rotated
from tisim.shapes.particle_shape import ParticleShape
from tisim.shapes.rod_pairs import closest_rods
from tisim.shapes.spherocylinder import SpherocylinderShape


class Rods(Shaped):
    """Particles are spherocylinders, or spheres, which are spherocylinders of length 0."""

    contract: ClassVar[bool] = True

    rods: tuple[SpherocylinderShape, ...] = option(
        "the shapes of the rods", examples=[(SpherocylinderShape(length=4e-3, diameter=1e-3),)], min_length=1
    )

    def shapes(self) -> Sequence[ParticleShape]:
        return self.rods

    @ti.func
    def segment(self, s, w, i, q):
        """Return half the segment of a rod as a vector (m), for the orientation q."""
        along = 0.0 * s.position[w, i]
        along[2] += 0.5 * self.size(s, w, i) * self.rods.length(w, s.shape[w, i])
        return rotated(q, along)

    @ti.func
    def rod_radius(self, s, w, i):
        """Return the radius (m) of a rod."""
        return 0.5 * self.size(s, w, i) * self.rods.diameter(w, s.shape[w, i])

    @ti.func
    def between(self, s, w, i, j, q_i, q_j, separation, far):
        here, there, along = s.shape[w, i], s.shape[w, j], 0.0 * separation
        along[2] += 1.0
        a, b = self.size(s, w, i), self.size(s, w, j)
        return closest_rods(
            separation,
            rotated(q_i, along),
            0.5 * a * self.rods.length(w, here),
            0.5 * a * self.rods.diameter(w, here),
            rotated(q_j, along),
            0.5 * b * self.rods.length(w, there),
            0.5 * b * self.rods.diameter(w, there),
        )
