"""Resistance to twisting about the line of centres, by springs with history."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.parts import TwistingResistance
from tisim.effects.contact.granular.spring import unloaded
from tisim.materials.materials import Touching


@ti.func
def _slipping(elastic, drag, limit):
    """Return the sum of an elastic couple and a drag, cut to a limit, and the elastic couple that remains."""
    couple = ti.max(-limit, ti.min(limit, elastic + drag))
    return couple, ti.select(couple == elastic + drag, elastic, couple - drag)


class TwistingMarshall(TwistingResistance):
    """The tangential springs and the friction of the contact circle resist twisting.

        M = T + gamma_t a^2/2 Omega,    dT/dt = S_t a^2/2 Omega,    |M| <= 2/3 a mu N

    S_t, gamma_t and mu belong to the tangential force, a is the radius of the circle, and Omega the relative
    spin about the normal. During unloading T decreases in proportion to its stiffness; ``twisting marshall``
    of LAMMPS remembers the angle instead.

    Source: J. S. Marshall, J. Comput. Phys. 228 (2009) 1541.
    """

    memory: ClassVar[int] = 2
    needs_tangential: ClassVar[bool] = True

    @ti.func
    def spring(self, w, pair, circle, spring):
        return spring * (0.5 * circle * circle)

    @ti.func
    def dashpot(self, w, pair, circle, dashpot):
        return dashpot * (0.5 * circle * circle)

    @ti.func
    def coulomb(self, w, pair, circle, friction):
        return 2.0 / 3.0 * circle * friction

    @ti.func
    def couple(self, w, pair, circle, spring, dashpot, friction, limit, twisting, past, dt):
        stiffness = self.spring(w, pair, circle, spring)
        elastic = unloaded(stiffness, past[1]) * past[0] + stiffness * dt * twisting
        drag = self.dashpot(w, pair, circle, dashpot) * twisting
        couple, known = _slipping(elastic, drag, self.coulomb(w, pair, circle, friction) * limit)
        return couple, ti.Vector([known, stiffness])


class TwistingSDS(TwistingResistance):
    """A spring, a dashpot and a slider with independent constants resist twisting.

        M = k_t xi + gamma_t Omega,    dxi/dt = Omega,    |M| <= mu_t N

    Omega is the relative spin about the normal; mu_t is a length. It is ``twisting sds`` of LAMMPS.

    Source: S. Luding, Granul. Matter 10 (2008) 235.
    """

    memory: ClassVar[int] = 1
    uses: ClassVar = ("twisting_friction", "twisting_stiffness", "twisting_damping")

    def mix(self, pair: Touching) -> dict[str, float]:
        return {
            "arm": pair.mixed("twisting_friction"),
            "constant": pair.mixed("twisting_stiffness"),
            "drag": pair.mixed("twisting_damping"),
        }

    @ti.func
    def spring(self, w, pair, circle, spring):
        return self.constant(w, pair) + 0.0 * circle

    @ti.func
    def dashpot(self, w, pair, circle, dashpot):
        return self.drag(w, pair) + 0.0 * circle

    @ti.func
    def coulomb(self, w, pair, circle, friction):
        return self.arm(w, pair) + 0.0 * circle

    @ti.func
    def couple(self, w, pair, circle, spring, dashpot, friction, limit, twisting, past, dt):
        stiffness = self.spring(w, pair, circle, spring)
        elastic = stiffness * (past[0] + dt * twisting)
        drag = self.dashpot(w, pair, circle, dashpot) * twisting
        couple, known = _slipping(elastic, drag, self.coulomb(w, pair, circle, friction) * limit)
        return couple, ti.Vector([known / stiffness])
