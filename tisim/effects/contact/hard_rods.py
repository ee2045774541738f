"""Hard spheres and rods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

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

    round_ends: ClassVar = True

    rods: tuple[SpherocylinderShape, ...] = option(
        "the shapes of the rods", examples=[(SpherocylinderShape(length=4e-3, diameter=1e-3),)], min_length=1
    )

    def shapes(self) -> Sequence[ParticleShape]:
        return self.rods

    @ti.func
    def closest(self, s, w, i, j, separation):
        return closest_rods(
            separation,
            self.axis(s, w, i),
            self.half(s, w, i),
            self.thickness(s, w, i),
            self.axis(s, w, j),
            self.half(s, w, j),
            self.thickness(s, w, j),
        )

    @ti.func
    def axis(self, s, w, i):
        """Return the unit vector along a rod."""
        q = self.turn(s, w, i)
        return rotated(q, ti.Vector([0.0 * q[0], 0.0 * q[0], 1.0 + 0.0 * q[0]]))

    @ti.func
    def half(self, s, w, i):
        """Return half the length (m) of the segment of a rod."""
        return 0.5 * self.size(s, w, i) * self.rods.length(w, s.shape[w, i])

    @ti.func
    def thickness(self, s, w, i):
        """Return the radius (m) of a rod, half its diameter."""
        return 0.5 * self.size(s, w, i) * self.rods.diameter(w, s.shape[w, i])

    @ti.func
    def end_count(self, s, w, i):
        return ti.select(self.half(s, w, i) > 0.0, 2, 1)

    @ti.func
    def end_centre(self, s, w, i, k):
        return ti.select(k == 0, 1.0, -1.0) * self.half(s, w, i) * self.axis(s, w, i)

    @ti.func
    def support(self, s, w, i, k, direction):
        return self.end_centre(s, w, i, k) + self.thickness(s, w, i) * direction

    @ti.func
    def closest_virtual(self, s, w, i, point, outward, along):
        half, radius = self.half(s, w, i), self.thickness(s, w, i)
        return closest_rods(point + radius * outward, self.axis(s, w, i), half, radius, along, half, radius)
