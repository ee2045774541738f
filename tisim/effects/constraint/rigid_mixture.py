"""Rigid rods and superquadrics in one scene, which move under contact laws."""

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.constraint.rigid_rods import RigidRods
from tisim.effects.constraint.rigid_shapes import RigidShapes
from tisim.effects.contact.mixture import Mixture


class RigidMixture(Mixture, RigidShapes):
    """All particles are rigid rods, spheres or superquadrics, which move under contact laws.

    The shapes of particles are numbered in the order of ``rods``, followed by ``superquadrics``. Two rods
    touch as in ``rigid_rods``, two superquadrics as in ``rigid_superquadrics``. A rod touches a superquadric
    with the common normal of their surfaces; the overlap is the shortest translation that separates them,
    which is the depth of the segment of the rod plus its radius. Spheres are rods of length 0.

    Source: L. Pournin, M. Weber, M. Tsukahara, J.-A. Ferrez, M. Ramaioli and T. M. Liebling, Granul. Matter 7
    (2005) 119, for spherocylinders; A. Podlozhnyuk, S. Pirker and C. Kloss, Comput. Part. Mech. 4 (2017) 101,
    for superquadrics.
    """

    corners: ClassVar[int] = RigidRods.corners

    @ti.func
    def corner(self, s, w, i, c, q, direction):
        # A superquadric has one corner; a point behind it touches nothing.
        x = -2.0 * s.radius[w, i] * direction
        if self.is_rod(s, w, i):
            x = RigidRods.corner(self, s, w, i, c, q, direction)
        elif c == 0:
            x = self.farthest(s, w, i, q, direction)
        return x
