"""Hard spheres and rods."""

from __future__ import annotations

from collections.abc import Sequence

from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import HardBodies
from tisim.numerics.vectors import rotated
from tisim.shapes.particle_shape import ParticleShape
from tisim.shapes.rod_pairs import closest_rods
from tisim.shapes.spherocylinder import SpherocylinderShape


class HardRods(HardBodies):
    """Hard spherocylinders and spheres, which are spherocylinders of length 0.

    Source: B16 section 2.2.2.
    """

    rods: tuple[SpherocylinderShape, ...] = option(
        "the shapes of the rods", examples=[(SpherocylinderShape(length=4e-3, diameter=1e-3),)], min_length=1
    )

    def shapes(self) -> Sequence[ParticleShape]:
        return self.rods

    @ti.func
    def closest(self, s, w, i, j, separation):
        here, there, along = s.shape[w, i], s.shape[w, j], 0.0 * separation
        along[2] += 1.0
        a, b = self.size(s, w, i), self.size(s, w, j)
        return closest_rods(
            separation,
            rotated(self.turn(s, w, i), along),
            0.5 * a * self.rods.length(w, here),
            0.5 * a * self.rods.diameter(w, here),
            rotated(self.turn(s, w, j), along),
            0.5 * b * self.rods.length(w, there),
            0.5 * b * self.rods.diameter(w, there),
        )
