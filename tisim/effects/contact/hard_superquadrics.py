"""Hard superquadrics."""

from tisim.backend.taichi import ti
from tisim.effects.base import HardBodies
from tisim.effects.contact.superquadrics import Superquadrics
from tisim.numerics.vectors import orientation_of


class HardSuperquadrics(Superquadrics, HardBodies):
    """Hard superquadrics, from spheres and ellipsoids (exponents 2) to boxes with rounded edges.

    Their common normal is found by Newton's method.

    Source: B16 chapter 4; ``tisim/shapes/superquadric_pairs.py`` says how this method differs.
    """

    @ti.func
    def support(self, s, w, i, k, direction):
        return self.farthest(s, w, i, self.turn(s, w, i), direction)

    @ti.func
    def closest_virtual(self, s, w, i, point, outward, along):
        centre = point + self.semi_axes(s, w, i)[0] * outward
        return self.between(s, w, i, i, self.turn(s, w, i), orientation_of(outward, along), centre, 0.0)
