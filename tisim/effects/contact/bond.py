"""Bonds of grains that have been pressed into each other (Z16 section 7.5)."""

from __future__ import annotations

from tisim.backend.taichi import ti
from tisim.effects.base import option, parameter
from tisim.effects.contact.normal import area, slip, strain
from tisim.effects.contact.surface import SurfaceContact
from tisim.numerics.elementary import Exponent, power


class ContactBond(SurfaceContact):
    """Grains that are pressed into each other are bonded: the bond pulls them together and resists sliding.

        F_i = K_nb E^p A n_ij + K_rb A dt u        while E >= E*

    E is the overlap strain, A the contact area, n_ij the unit vector from i to j, and u the velocity of the
    surface of j relative to the surface of i at the point of contact, spin included. The bond has no history:
    it exists while the overlap strain is at least E*. The grip contains the time step dt, as the stick force
    of ``contact_friction`` does: it vanishes with dt, and is absent from the forces at the start.

    Source: Z16 Eqs (7.16), (7.17).
    """

    stiffness: float = parameter(
        "N/m^2", "stiffness K_nb of the bond along the line of centres", examples=[1e5], ge=0
    )
    exponent: Exponent = option("exponent p of the overlap strain", 2, gt=0)
    grip_stiffness: float = parameter("N/m^3", "stiffness K_rb of the grip along the surfaces", 0.0, ge=0)
    threshold: float = parameter(
        "",
        "smallest overlap strain E* at which the bond holds; Z16 gives no value",
        examples=[0.01],
        ge=0,
        lt=1,
    )

    @ti.func
    def surface_force(self, s, w, i, j, separation, distance):
        total = 0.0 * separation
        e, a = strain(s, w, i, j, distance), area(s, w, i, j, distance)
        if e >= self.threshold(w):
            total = self.stiffness(w) * power(e, self.exponent) * a / distance * separation
            dt = ti.cast(s.dt[w], s.real)
            total += self.grip_stiffness(w) * a * dt * slip(s, w, i, j, separation, distance)
        return total
