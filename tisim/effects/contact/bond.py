"""Bonds of grains that have been pressed into each other (Z16 section 7.5)."""

from __future__ import annotations

from pydantic import Field as Option

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.normal import area, slip, strain
from tisim.effects.contact.surface import SurfaceContact
from tisim.numerics.powers import Exponent, power


class ContactBond(SurfaceContact):
    """While E >= E*: F_i = K_nb E^p A n_ij + K_rb A dt u, a pull and a grip.

    stiffness : K_nb. exponent : p, compiled in. grip_stiffness : K_rb. threshold : E*, an overlap strain;
    Z16 section 9 gives no value. The bond has no memory: it is there while the overlap is.

    E is the overlap strain, A the contact area, u the velocity of the surface of j past that of i at their
    point of contact, spin included. The grip carries the time step dt, as stick does (friction.py):
    it vanishes with dt, and is absent from the forces of the start.
    Source: Z16 Eqs (7.16), (7.17).
    """

    stiffness: float = parameter("N/m^2", ge=0)
    exponent: Exponent = Option(2, gt=0)
    grip_stiffness: float = parameter("N/m^3", 0.0, ge=0)
    threshold: float = parameter("", ge=0, lt=1)

    @ti.func
    def surface_force(self, s, w, i, j, separation, distance):
        total = 0.0 * separation
        e, a = strain(s, w, i, j, distance), area(s, w, i, j, distance)
        if e >= self.threshold(w):
            total = self.stiffness(w) * power(e, self.exponent) * a / distance * separation
            dt = ti.cast(s.dt[w], s.real)
            total += self.grip_stiffness(w) * a * dt * slip(s, w, i, j, separation, distance)
        return total
