"""Magnetic moments of soft particles, along the local field (B16 sections 6.2.4, 7.2.3).

The field is the sum of all sources of a magnetic flux density at the centre of the particle, B = mu_0 H
outside of magnets. A moment follows it at once, inside the particle, so that the particle feels no torque.
Moments that also depend on each other are in mutual_moment.py. Other effects read the field ``moment``,
whichever effect has set it.
"""

from __future__ import annotations

from typing import Any, ClassVar

from scipy.constants import Boltzmann, mu_0

from tisim.backend.taichi import ti
from tisim.effects.base import DerivedQuantity, parameter
from tisim.numerics.langevin import langevin_ratio
from tisim.sources.base import sources
from tisim.state.bound import Peers
from tisim.state.fields import Field

MOMENT = Field("moment", "A m^2", 3, "sum")
SATURATION = Field("saturation_moment", "A m^2", 1, "sum", default=None, minimum=0.0)
DOMAIN = Field("domain_moment", "A m^2", 1, "mean", default="saturation_moment", minimum=0.0)


class Moment(DerivedQuantity):
    """This is the contract of a law that gives each particle a magnetic moment, m = law(B)."""

    contract: ClassVar[bool] = True
    quantity = "moment"
    requires_source = ("magnetic_flux_density",)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"applied": sources(peers, "magnetic_flux_density")}

    @ti.func
    def law(self, s, w, i, b):
        """Return the moment (A m^2) of i in a field b (T)."""
        return 0.0 * b

    @ti.func
    def with_sources(self, s, w, i, b, t):
        """Return b (T) plus the field of all sources at particle i."""
        total = b
        for source in ti.static(self.applied):
            total += source.value(w, s.position[w, i], t)
        return total

    @ti.func
    def response(self, s, w, i, total, t):
        """Return the moment (A m^2) of i in the field of the sources plus ``total`` (T), the field of other
        particles if they interact."""
        return self.law(s, w, i, self.with_sources(s, w, i, total, t))


class FixedMoment(Moment):
    """Each particle has a magnetic moment of fixed magnitude along the local field.

        m = m_s B/|B|,    0 without a field

    B is the sum of all sources, and m_s the ``saturation_moment`` (A m^2) of each particle, given by the
    start. Without a field no direction is preferred, and the mean over all directions is 0.

    Source: B16 section 6.2.4, table 6.1.
    """

    fields = (MOMENT, SATURATION)

    @ti.func
    def law(self, s, w, i, b):
        size = b.norm()
        return s.saturation_moment[w, i] / ti.select(size > 0.0, size, 1.0) * b


class LangevinMoment(Moment):
    """Each particle is superparamagnetic: its moment follows Langevin's law, without hysteresis.

        m = m_s L(x) B/|B|,    L(x) = coth x - 1/x,    x = mu_d |B| / (k T)

    B is the sum of all sources. m_s is the ``saturation_moment`` (A m^2) of each particle, its saturation
    magnetisation times its volume. mu_d is its ``domain_moment`` (A m^2), the moment of a single domain in
    it; by default the particle is one domain. For x << 1 the law is linear, m_s mu_d B / (3 k T) (B16 7.7).

    Source: B16 Eqs (6.22), (7.5).
    """

    fields = (MOMENT, SATURATION, DOMAIN)

    temperature: float = parameter("K", "temperature T of the particles", examples=[300.0], gt=0)

    @ti.func
    def law(self, s, w, i, b):
        scale = s.domain_moment[w, i] / (Boltzmann * self.temperature(w))
        return s.saturation_moment[w, i] * scale * langevin_ratio(scale * b.norm()) * b


class InducedMoment(Moment):
    """Each particle is a sphere of linear material that the local field magnetises.

        m = V 3 chi / (3 + chi) B / mu_0

    V is its volume, B the sum of all sources. The law accounts for the field of the sphere inside itself,
    -M/3.

    Source: L21 Eq. (2.4).
    """

    fields = (MOMENT, "radius")

    susceptibility: float = parameter(
        "",
        "magnetic susceptibility chi = mu_r - 1 of the material; -1 excludes all field",
        examples=[1.0],
        ge=-1,
    )

    @ti.func
    def law(self, s, w, i, b):
        chi, radius = self.susceptibility(w), s.radius[w, i]
        # 4/3 pi R^3 3 chi / (3 + chi), which stays finite however large chi is.
        return 4.0 * ti.math.pi / mu_0 * (chi / (3.0 + chi)) * radius * radius * radius * b


class FroehlichMoment(Moment):
    """Each particle is a sphere of iron or an oxide, whose magnetisation saturates by Froehlich's law.

        M = chi H M_s / (M_s + chi H),    H = B/mu_0 - M/3,    m = V M

    H is the field inside the sphere, which its own magnetisation weakens, and B the sum of all sources. With
    k = 3 chi / (3 + chi) and u = k |B| / (mu_0 M_s) the root of this equation is

        M/M_s = 2 u / (1 + u + sqrt((u + q)^2 + 1 - q^2)),    q = (3 - chi) / (3 + chi)

    which is free of cancellation. In weak fields it is ``induced_moment``, M = k B / mu_0; in strong fields M
    is M_s - M_s^2 / (chi H). There is no hysteresis.

    Source: A. E. Kennelly, Trans. Am. Inst. Electr. Eng. 8 (1891) 485, after O. Froehlich (1881); R. M.
    Bozorth, Ferromagnetism (1951) 476; for iron in magnetorheological fluids J. M. Ginder, L. C. Davis, L. D.
    Elie, Int. J. Mod. Phys. B 10 (1996) 3293.
    """

    fields = (MOMENT, "radius")

    susceptibility: float = parameter(
        "",
        "magnetic susceptibility chi = mu_r - 1 of the material in weak fields",
        examples=[999.0],
        gt=0,
    )
    saturation: float = parameter(
        "A/m", "saturation magnetisation M_s of the material", examples=[1.671e6], gt=0
    )

    @ti.func
    def law(self, s, w, i, b):
        chi, radius = self.susceptibility(w), s.radius[w, i]
        gain = 3.0 * (chi / (3.0 + chi)) / mu_0
        u = gain / self.saturation(w) * b.norm()
        # 1 - q^2 = 12 chi / (3 + chi)^2; all divided by 1 + u, so that no square overflows.
        q, rest, whole = 3.0 / (3.0 + chi) - chi / (3.0 + chi), 2.0 / (3.0 + chi), 1.0 + u
        across = ti.sqrt(3.0 * chi) * rest / whole
        part = 2.0 / whole / (1.0 + ti.sqrt(((u + q) / whole) ** 2 + across * across))
        return 4.0 / 3.0 * ti.math.pi * gain * radius * radius * radius * part * b
