"""Rigid superquadrics, which move under contact laws."""

from tisim.backend.taichi import ti
from tisim.effects.constraint.rigid_shapes import RigidShapes
from tisim.effects.contact.superquadrics import Superquadrics


class RigidSuperquadrics(Superquadrics, RigidShapes):
    """All particles are rigid superquadrics, such as ellipsoids and rounded boxes, that move under contact
    laws.

    Two bodies touch at one point, with the common normal of their surfaces, and the overlap is the shortest
    translation that separates them. A plane touches the point that is farthest along its normal. The radius
    of curvature in the contact laws is the radius of the sphere of the same volume; A. Podlozhnyuk, S. Pirker
    and C. Kloss use the curvatures at the point of contact instead, with which elastic forces would not keep
    the energy, as the stiffness would change with the orientation.

    Source: A. Podlozhnyuk, S. Pirker and C. Kloss, Comput. Part. Mech. 4 (2017) 101, for contacts of
    superquadrics by laws for spheres; A. Dullweber, B. Leimkuhler, R. McLachlan, J. Chem. Phys. 107 (1997)
    5840, for the rotation.
    """

    @ti.func
    def corner(self, s, w, i, c, q, direction):
        return self.farthest(s, w, i, q, direction)
