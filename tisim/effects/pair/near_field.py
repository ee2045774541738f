"""Near field: attraction and repulsion by powers of distance (Z16 Eq. 7.23, Z13 Eq. 24).

    F_i = sum_j (alpha_1 d^-beta_1 - alpha_2 d^-beta_2) n_ij,   n_ij from i to j

so alpha_1 attracts and alpha_2 repels. The coefficients are plain numbers (Z13), or depend on the strengths
of the two particles (Z16, text after 7.23): alpha = abar s_i s_j c_i c_j, with s the mass, the surface area,
the volume or the charge, and c = +1 or -1 a positive or negative identifier. As printed, c_i c_j multiplies
both terms: between unlike particles the first repels and the second attracts. (Z16 section 9 calls its abar
"per unit mass"; by this formula it is per unit mass squared.)

With charges as strengths, beta_2 = 2 and only abar_2 = 1/(4 pi epsilon) nonzero, this is Coulomb's law. (Z13
Eq. 22 lacks the minus sign that its n_ij, from i to j, requires: like charges repel.)
"""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import three_digits
from tisim.effects.base import Effect, PairForce, option, parameter
from tisim.effects.base.critical_step import critical_step
from tisim.numerics.elementary import Exponent, power
from tisim.state.fields import Field

CUTOFF_PARTS = (0.1, 0.2, 0.5, 1.0)
"""Cut-offs, over the largest distance, that are tried as approximations."""


class NearField(PairForce):
    """Particles attract and repel each other by powers of their distance, over all pairs.

        F_i = sum_j (alpha_1 d^-beta_1 - alpha_2 d^-beta_2) n_ij,    alpha = abar s_i s_j c_i c_j

    n_ij is the unit vector from i to j, so alpha_1 attracts and alpha_2 repels. The strength s of a particle
    is 1 ("plain"), its mass (kg), its surface area 4 pi R^2 ("area"), its volume or its charge (C, signed). c
    is its field ``polarity``, +1 or -1, if the law is signed, and 1 otherwise. In a periodic box only the
    nearest image of a particle acts.

    Source: Z16 Eq. (7.23), Z13 Eq. (24).
    """

    fields = ("charge", Field("polarity", "", 1, "keep", integer=True, default=None))

    alpha1: float = parameter(
        "N m^beta1", "coefficient abar_1 of attraction, per product of the two strengths", 0.0, ge=0
    )
    beta1: Exponent = option("exponent beta_1 of attraction; whole numbers are fastest", 1, ge=0)
    alpha2: float = parameter(
        "N m^beta2", "coefficient abar_2 of repulsion, per product of the two strengths", 0.0, ge=0
    )
    beta2: Exponent = option("exponent beta_2 of repulsion; whole numbers are fastest", 2, ge=0)
    strength: Literal["plain", "mass", "area", "volume", "charge"] = option(
        "quantity that is the strength s of a particle", "plain"
    )
    signed: bool = option("whether particles carry a polarity c, +1 or -1", False)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        own = {name: getattr(self, name) for name in NearField.model_fields}
        return tuple(TruncatedNearField(**own, cutoff=three_digits(part * extent)) for part in CUTOFF_PARTS)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        strength = {
            "plain": np.ones_like(start["mass"]),
            "mass": start["mass"],
            "area": 4 * np.pi * start["radius"] ** 2,
            "volume": 4 / 3 * np.pi * start["radius"] ** 3,
            "charge": np.abs(start.get("charge", np.zeros_like(start["mass"]))),
        }[self.strength]
        # For two particles at contact with the smallest mass, the smallest radius and the largest strength.
        contact = 2 * float(start["radius"].min(initial=math.inf))
        steepest = sum(
            alpha * beta / contact ** (beta + 1)
            for alpha, beta in ((self.alpha1, self.beta1), (self.alpha2, self.beta2))
        )
        stiffness = steepest * float(strength.max(initial=0.0)) ** 2
        return critical_step(stiffness, 0.5 * float(start["mass"].min(initial=math.inf)))

    def required_fields(self) -> tuple[str | Field, ...]:
        charge, polarity = self.fields
        return (charge,) * (self.strength == "charge") + (polarity,) * self.signed

    @ti.func
    def own(self, s, w, i):
        """Return c_i s_i, the factor of a particle in the law of a pair."""
        size = ti.cast(1.0, s.real)
        if ti.static(self.strength == "mass"):
            size = s.mass[w, i]
        elif ti.static(self.strength == "area"):
            size = 4.0 * ti.math.pi * s.radius[w, i] ** 2
        elif ti.static(self.strength == "volume"):
            size = 4.0 / 3.0 * ti.math.pi * s.radius[w, i] ** 3
        elif ti.static(self.strength == "charge"):
            size = s.charge[w, i]
        if ti.static(self.signed):
            size *= s.polarity[w, i]
        return size

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return self.between(s, w, i, j, separation, distance)

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        attraction = self.alpha1(w) * power(inverse, 1 + self.beta1)
        repulsion = self.alpha2(w) * power(inverse, 1 + self.beta2)
        return self.own(s, w, i) * self.own(s, w, j) * (attraction - repulsion) * separation

    @ti.func
    def between(self, s, w, i, j, separation, distance):
        """Return the force on i by j, in N."""
        # Each divided by d once more, for n_ij = separation / d; one division serves both whole powers.
        attraction = self.alpha1(w) * power(distance, -1 - self.beta1)
        repulsion = self.alpha2(w) * power(distance, -1 - self.beta2)
        return self.own(s, w, i) * self.own(s, w, j) * (attraction - repulsion) * separation


class TruncatedNearField(NearField):
    """Particles within a cut-off attract and repel each other by powers of distance; beyond it no force acts.

    The law is the same as ``near_field``; pairs are found with the pair list. The force is not shifted: it
    jumps at the cut-off. Z13 and Z16 use no cut-off.

    Source: Z16 Eq. (7.23), Z13 Eq. (24).
    """

    short_ranged = True
    truncated: ClassVar[bool] = True
    # The force jumps at the cut-off.
    kinked: ClassVar[bool] = True

    cutoff: float = parameter("m", "cut-off distance of the centres", examples=[0.1], gt=0)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return ()

    @ti.func
    def reach(self, s, w, i):
        # Between surfaces, if the other particle is a point.
        return self.cutoff(w) - s.radius[w, i]

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        total = 0.0 * separation
        if distance <= self.cutoff(w):
            total = self.between(s, w, i, j, separation, distance)
        return total
