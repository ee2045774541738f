"""The common base of Ewald sums of dipoles: their settings, and the sum over near pairs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator
from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.domains.domain import Domain
from tisim.effects.base import Effect, LongRange, SceneParts, Vector, option, parameter
from tisim.effects.magnetic.dipole_pairs import Dipoles
from tisim.effects.magnetic.ewald_accuracy import WIDEST_DECAY, most_waves, screening_for, waves_for
from tisim.errors import must
from tisim.numerics import elementary
from tisim.numerics.error_function import erfcx

TWO_OVER_ROOT_PI = 2.0 / math.sqrt(math.pi)


class EwaldPairs(LongRange, Dipoles):
    """This is the contract of interactions between dipoles with all their images, summed after Ewald.

        U = U_pairs + U_waves - mu_0 alpha^3 / (6 pi^(3/2)) sum m_i^2 + mu_0 / (2 V) sum_a N_a M_a^2
        U_pairs = mu_0 / (4 pi) sum_pairs [b m_i.m_j - c (m_i.n)(m_j.n)] / d^3,    d <= r_c
        U_waves = mu_0 / (2 V) sum_k exp(-k^2 / (4 alpha^2)) / k^2 |S(k)|^2,       0 < |k| <= k_max
        S(k) = sum_j (m_j.k) exp(i k.r_j),    M = sum_j m_j
        b = erfc(x) + 2 x exp(-x^2) / sqrt(pi),    c = 3 b + 4 x^3 exp(-x^2) / sqrt(pi),    x = alpha d

    alpha and k_max follow from ``cutoff`` and ``accuracy`` (ewald_accuracy.py), unless they are given.
    ``waves`` is the capacity for wave vectors along each axis, as ``ewald_settings`` returns it. A scene
    whose box needs more is refused.

    N_a are the demagnetising factors of the sample that contains the box. With 0 the sample has no poles:
    applied fields are the fields inside it (conducting, "tin-foil" boundary). With 1/3 along each axis the
    sample is a ball in vacuum, with 1 along one axis a wide plate across this axis; applied fields are then
    the fields without the sample.

    The box may be open along one axis, as between plates. The sum is then over periodic images of the plate,
    at a distance of ``slab_factor`` sides, with N = 1 across the plates. This removes the interaction of the
    plates through their total moments; the remaining error falls as exp(-2 pi gap / side). A world stops if
    the centre of a particle leaves the box along the open axis, since the gap is then too small: the field
    there is not finite.

    Source: S. W. de Leeuw, J. W. Perram, E. R. Smith, Proc. R. Soc. Lond. A 373 (1980) 27; Z. Wang, C. Holm,
    J. Chem. Phys. 115 (2001) 6351; for plates I.-C. Yeh, M. L. Berkowitz, J. Chem. Phys. 111 (1999) 3155, and
    A. Brodka, Chem. Phys. Lett. 400 (2004) 62.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = True
    # A finer accuracy needs more waves, which the capacity may not allow.
    accuracy_parameters = (AccuracyParameter(accuracy=1, converges=False),)
    alike = ("cutoff", "accuracy", "screening", "wave_cutoff", "demagnetising_factors", "slab_factor")

    cutoff: float = parameter("m", "cut-off distance r_c of the centres of pairs", examples=[1e-4], gt=0)
    waves: tuple[int, int, int] = option("capacity for wave vectors along x, y and z", examples=[(8, 8, 8)])
    accuracy: float = parameter(
        "",
        "root mean square error of the forces, over the force of dipoles at the cut-off",
        1e-4,
        gt=1e-14,
        le=0.1,
    )
    screening: float | None = parameter("1/m", "screening alpha; by default from the accuracy", None, gt=0)
    wave_cutoff: float | None = parameter(
        "1/m", "largest wave vector k_max; by default from the accuracy", None, gt=0
    )
    demagnetising_factors: Vector = parameter(
        "",
        "factors N of the sample along x, y and z, with a sum of at most 1; 0 for a sample without poles",
        (0.0,) * 3,
    )
    slab_factor: float = parameter(
        "", "period of the images along an open axis, over the side of the box", 3.0, ge=2
    )

    @model_validator(mode="after")
    def _summable(self) -> Self:
        must(min(self.waves) >= 0, f"{self.label}.waves", "at least 0 each", self.waves)
        if self.screening is not None:
            rule = f"from {1 / self.cutoff:g} to {WIDEST_DECAY / self.cutoff:g} with this cutoff"
            within = 1 <= self.screening * self.cutoff <= WIDEST_DECAY
            must(within, f"{self.label}.screening", rule, self.screening)
        n = self.demagnetising_factors
        rule = "from 0 on, and at most 1 together"
        must(min(n) >= 0 and sum(n) <= 1 + 1e-6, f"{self.label}.demagnetising_factors", rule, n)
        return self

    def at_start(self, masses: np.ndarray) -> Self:
        screening = self.screening or screening_for(self.accuracy) / self.cutoff
        s = waves_for(self.accuracy, screening * self.cutoff)
        limits = {"screening": screening, "wave_cutoff": self.wave_cutoff or 2 * s * screening}
        return self.model_copy(update=limits)

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        domain = scene.domain
        joined, where = domain.imaged(), f"effects.{self.label}"
        rule = f"periodic along two or three axes, with {where}"
        must(sum(joined) >= 2 and not domain.shears(), domain.label, rule, joined)
        poles, rule = any(self.demagnetising_factors), "0 in a box with an open axis, along which it is 1"
        must(all(joined) or not poles, f"{where}.demagnetising_factors", rule, self.demagnetising_factors)
        limit = self.at_start(np.empty(0)).wave_cutoff or 0.0
        needed = most_waves(domain, self.slab_factor, limit)
        enough = all(there >= need for there, need in zip(self.waves, needed, strict=True))
        must(enough, f"{where}.waves", f"at least {needed} in this box", self.waves)

    def failure_hint(self, effects: Sequence[Effect], domain: Domain) -> str:
        beyond = "the centre of a particle is beyond the box along its open axis"
        return "" if all(domain.imaged()) else beyond

    @ti.func
    def reach(self, s, w, i):
        return self.cutoff(w) - s.radius[w, i]

    @ti.func
    def screened(self, w, distance):
        """Return b and c, and d = 5 c + 8 x^5 exp(-x^2) / sqrt(pi): 1, 3 and 15 for x = 0, and 0 beyond the
        cut-off."""
        x = self.screening(w) * distance
        near = ti.select(distance <= self.cutoff(w), elementary.exp(-x * x), 0.0 * x)
        square, tail = x * x, TWO_OVER_ROOT_PI * x * near
        b = near * erfcx(x) + tail
        c = 3.0 * b + 2.0 * square * tail
        return b, c, 5.0 * c + 4.0 * square * square * tail

    @ti.func
    def near_field(self, s, w, j, separation, distance):
        """Return the contribution of near pairs to the field (T) of j at a point; ``separation`` (m) leads
        from the point to j."""
        b, c, _d = self.screened(w, distance)
        inverse = 1.0 / distance
        n = inverse * separation
        # Cube first: in f32 the square of a moment of 1e-17 A m^2 underflows.
        m = mu_0 / (4.0 * math.pi) * inverse * inverse * inverse * s.moment[w, j]
        return c * m.dot(n) * n - b * m

    @ti.func
    def near_force(self, s, w, i, j, separation, distance):
        """Return the contribution of near pairs to the force on i by j, in N."""
        _b, c, d = self.screened(w, distance)
        inverse = 1.0 / distance
        n, square = inverse * separation, inverse * inverse
        a, b = s.moment[w, i], (mu_0 / (4.0 * math.pi) * square * square) * s.moment[w, j]
        along_a, along_b = a.dot(n), b.dot(n)
        return (d * along_a * along_b - c * a.dot(b)) * n - c * (along_a * b + along_b * a)
