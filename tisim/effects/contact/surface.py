"""The common base of forces at the surfaces of touching spheres, which exert torques on both."""

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import PairForce
from tisim.effects.contact.normal import NormalContact, arm


class SurfaceContact(PairForce):
    """This is the contract of a force at the point of contact of touching spheres, which exerts torques on
    both."""

    contract: ClassVar[bool] = True
    kinked: ClassVar[bool] = True
    step_dependent: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = True
    fields = ("radius", "velocity", "spin")
    depends_on_velocity: ClassVar[bool] = True
    requires: ClassVar = (NormalContact,)

    @ti.func
    def surface_force(self, s, w, i, j, separation, distance):
        """Return the force (N) on i by j; both touch."""
        return 0.0 * separation

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        force, turn, back = 0.0 * separation, 0.0 * separation, 0.0 * separation
        if distance <= s.radius[w, i] + s.radius[w, j]:
            force = self.surface_force(s, w, i, j, separation, distance)
            # n x F has the same value for both spheres.
            couple = separation.cross(force) / distance
            turn = arm(s, w, i, j, distance) * couple
            back = arm(s, w, j, i, distance) * couple
        return force, turn, back, past
