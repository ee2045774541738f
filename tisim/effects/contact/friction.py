"""Regularised friction of touching grains that spin (Z16 section 7.4)."""

from __future__ import annotations

from typing import Any, Self

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.normal import NormalContact, area, slip
from tisim.effects.contact.surface import SurfaceContact
from tisim.errors import must
from tisim.state.bound import Peers


class ContactFriction(SurfaceContact):
    """Regularised friction resists the sliding of touching grains and exerts torques on them.

        F_i = K_f A dt u            stick, while that is below mu_s |F_n|
        F_i = mu_d |F_n| u / |u|    slip

    u is the velocity of the surface of j relative to the surface of i at the point of contact, spin included;
    A is the contact area; |F_n| is the contact force without dissipation (the paper has con,n here, con,c in
    7.5, con,d in 7.10).

    The stick force contains the time step dt. It is a viscous regularisation: a spring K_f A acts on the
    displacement of one step, without memory of earlier steps. As dt -> 0 it does not converge to sticking but
    vanishes, and grains creep past each other. The forces at the start, before any step, have dt = 0 and no
    stick.

    Source: Z16 Eqs (7.11)-(7.15).
    """

    stiffness: float = parameter("N/m^3", "tangential stiffness K_f per contact area", examples=[1e8], ge=0)
    static: float = parameter("", "coefficient mu_s of static friction", examples=[0.5], ge=0)
    dynamic: float = parameter(
        "", "coefficient mu_d of dynamic friction, at most the static one", examples=[0.4], ge=0
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        must(self.dynamic <= self.static, "contact_friction.dynamic", "at most static", self.dynamic)
        return self

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"normal": peers.of(NormalContact)}

    @ti.func
    def surface_force(self, s, w, i, j, separation, distance):
        pressed = 0.0 * distance
        for contact in ti.static(self.normal):
            pressed += contact.compression(s, w, i, j, distance)
        u = slip(s, w, i, j, separation, distance)
        speed, dt = u.norm(), ti.cast(s.dt[w], s.real)
        viscosity = self.stiffness(w) * area(s, w, i, j, distance) * dt
        if viscosity * speed > self.static(w) * pressed:
            viscosity = self.dynamic(w) * pressed / speed
        return viscosity * u
