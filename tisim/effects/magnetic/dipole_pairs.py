"""What dipoles do to each other: the field of one, and how far it goes, over all pairs or up to a cut-off."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from pydantic import model_validator
from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.effects.base import option, parameter
from tisim.effects.base.pairwise import Pairwise
from tisim.errors import must


@ti.func
def dipole_field(moment, separation, distance):
    """Return the field (T) of a dipole (A m^2) at a place it is at the ``separation`` (m) from, of length
    ``distance``: mu_0 / (4 pi d^3) (3 (m.n) n - m)."""
    inverse = 1.0 / distance
    n = inverse * separation
    # Cube first: in f32 a moment of 1e-17 A m^2 squared is nothing.
    m = inverse * inverse * inverse * moment
    return mu_0 / (4.0 * ti.math.pi) * (3.0 * m.dot(n) * n - m)


class DipolePairs(Pairwise):
    """This is the contract of what dipoles do to each other over all pairs, or up to a cut-off.

        d_c = cutoff (R_i + R_j)/2 + gap,    x = d/d_c,    f(x) = 1 plain, 1 - 4 x^3 + 3 x^4 shifted

    The energy of a pair, and the field of one at the other, are those of dipoles times f, and 0 beyond d_c. A
    plain cut-off leaves forces as they are and has them jump; shifted, f(1) = f'(1) = 0 and all of them end
    smoothly.

    Source: the shift is that of M. Orsi, D. Y. Haubertin, W. E. Sanderson, J. W. Essex, J. Phys. Chem. B 112
    (2008) 802, which is lj/sf/dipole/sf in LAMMPS.
    """

    contract: ClassVar[bool] = True
    within_bodies: ClassVar[bool] = True

    cutoff: float = parameter(
        "", "cut-off distance of the centres, over the mean radius of the two; 0 for all pairs", 0.0, ge=0
    )
    gap: float = parameter(
        "m", "length added to the cut-off distance; beside a cutoff of 2, the gap between surfaces", 0.0, ge=0
    )
    shifted: bool = option("whether energies, fields and forces go to 0 smoothly at the cut-off", False)

    @model_validator(mode="after")
    def _beyond_contact(self) -> Self:
        rule = "greater than 2, or 2 beside a gap, or 0 without a gap for all pairs"
        apart = self.cutoff > 2 or (self.cutoff == 2 and self.gap > 0)
        must(apart or self.cutoff == self.gap == 0, f"{self.label}.cutoff", rule, self.cutoff)
        must(self.short_ranged or not self.shifted, f"{self.label}.shifted", "false without a cutoff", True)
        return self

    @property
    def short_ranged(self) -> bool:  # type: ignore[override]
        """Return whether there is a cut-off."""
        return self.cutoff > 0

    def structure(self) -> tuple[Any, ...]:
        return (*super().structure(), self.short_ranged)

    @ti.func
    def reach(self, s, w, i):
        # Between surfaces, of two as large as i: (cutoff / 2 - 1) (R_i + R_j) + gap.
        return (self.cutoff(w) - 2.0) * s.radius[w, i] + self.gap(w)

    @ti.func
    def part(self, s, w, i, j, distance):
        """Return f, and d f'(d)."""
        part, slope = 1.0 + 0.0 * distance, 0.0 * distance
        if ti.static(self.short_ranged):
            limit = 0.5 * self.cutoff(w) * (s.radius[w, i] + s.radius[w, j]) + self.gap(w)
            if ti.static(self.shifted):
                x = distance / limit
                # 1 - 4 x^3 + 3 x^4 as a product, in which nothing cancels near 1.
                part = (1.0 - x) * (1.0 - x) * (1.0 + 2.0 * x + 3.0 * x * x)
                slope = 12.0 * x * x * x * (x - 1.0)
            part = ti.select(distance <= limit, part, 0.0)
            slope = ti.select(distance <= limit, slope, 0.0)
        return part, slope
