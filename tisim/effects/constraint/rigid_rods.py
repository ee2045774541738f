"""Rigid rods, which move under contact laws."""

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.constraint.rigid_shapes import RigidShapes
from tisim.effects.contact.rods import Rods


class RigidRods(Rods, RigidShapes):
    """All particles are rigid spherocylinders, or spheres, that move under contact laws.

    Two rods touch where their segments are nearest to each other, and a plane touches both ends of a rod
    separately, so that a rod can lie on it. The radius of curvature in the contact laws is the radius D/2 of
    the rod. Ends therefore touch as the spheres at the ends of a clump do; two crossed cylinders would be
    stiffer by a factor sqrt(2).

    Source: L. Pournin, M. Weber, M. Tsukahara, J.-A. Ferrez, M. Ramaioli and T. M. Liebling, Granul. Matter 7
    (2005) 119, for contacts of spherocylinders; A. Dullweber, B. Leimkuhler, R. McLachlan, J. Chem. Phys. 107
    (1997) 5840, for the rotation.
    """

    corners: ClassVar[int] = 2

    @ti.func
    def corner(self, s, w, i, c, q, direction):
        half, side = self.half(s, w, i), ti.select(c == 0, 1.0, -1.0)
        # A sphere has one end; a point behind it touches nothing.
        surplus = (c > 0) & (half == 0.0)
        reach = ti.select(surplus, -2.0 * s.radius[w, i], self.rod_radius(s, w, i))
        return ti.cast(side, s.real) * half * self.axis(q) + reach * direction
