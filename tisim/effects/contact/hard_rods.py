"""Hard spheres and rods."""

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import HardBodies
from tisim.effects.contact.rods import Rods
from tisim.shapes.rod_pairs import closest_rods


class HardRods(Rods, HardBodies):
    """Hard spherocylinders and spheres, which are spherocylinders of length 0.

    Source: B16 section 2.2.2.
    """

    round_ends: ClassVar = True

    @ti.func
    def end_count(self, s, w, i):
        return ti.select(self.half(s, w, i) > 0.0, 2, 1)

    @ti.func
    def end_centre(self, s, w, i, k):
        return ti.select(k == 0, 1.0, -1.0) * self.half(s, w, i) * self.axis(self.turn(s, w, i))

    @ti.func
    def support(self, s, w, i, k, direction):
        return self.end_centre(s, w, i, k) + self.rod_radius(s, w, i) * direction

    @ti.func
    def closest_virtual(self, s, w, i, point, outward, along):
        axis, half, radius = self.axis(self.turn(s, w, i)), self.half(s, w, i), self.rod_radius(s, w, i)
        return closest_rods(point + radius * outward, axis, half, radius, along, half, radius)
