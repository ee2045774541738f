"""Hard rods and superquadrics in one packing."""

from tisim.backend.taichi import ti
from tisim.effects.base import HardBodies
from tisim.effects.contact.hard_rods import HardRods
from tisim.effects.contact.hard_superquadrics import HardSuperquadrics
from tisim.effects.contact.mixture import Mixture


class HardMixture(Mixture, HardBodies):
    """Hard rods, spheres and superquadrics in one packing; spheres are rods of length 0.

    The shapes of particles are numbered in the order of ``rods``, followed by ``superquadrics``. The distance
    of two rods is in closed form; other common normals are found by Newton's method.

    Source: B16 section 2.2.2 for rods, chapter 4 for superquadrics.
    """

    @ti.func
    def end_count(self, s, w, i):
        return ti.select(self.is_rod(s, w, i), HardRods.end_count(self, s, w, i), 1)

    @ti.func
    def end_centre(self, s, w, i, k):
        return ti.select(self.is_rod(s, w, i), HardRods.end_centre(self, s, w, i, k), 0.0 * s.position[w, i])

    @ti.func
    def support(self, s, w, i, k, direction):
        x = 0.0 * direction
        if self.is_rod(s, w, i):
            x = HardRods.support(self, s, w, i, k, direction)
        else:
            x = HardSuperquadrics.support(self, s, w, i, k, direction)
        return x

    @ti.func
    def closest_virtual(self, s, w, i, point, outward, along):
        gap, normal, here, there = 0.0 * point[0], 0.0 * point, 0.0 * point, 0.0 * point
        if self.is_rod(s, w, i):
            gap, normal, here, there = HardRods.closest_virtual(self, s, w, i, point, outward, along)
        else:
            gap, normal, here, there = HardSuperquadrics.closest_virtual(self, s, w, i, point, outward, along)
        return gap, normal, here, there
