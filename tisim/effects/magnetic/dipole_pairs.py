"""The interaction of dipoles: the field of one dipole, and its range, over all pairs or up to a cut-off."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import model_validator
from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.effects.base import (
    Effect,
    PairForce,
    SceneParts,
    SelfConsistentQuantity,
    keeps_apart,
    option,
    parameter,
)
from tisim.effects.base.pairwise import Pairwise
from tisim.effects.magnetic.permanent_moment import PermanentMoment
from tisim.errors import must


@ti.func
def dipole_field(moment, separation, distance):
    """Return the field (T) of a dipole (A m^2) at a point; ``separation`` (m), of length ``distance``, leads
    from the point to the dipole: mu_0 / (4 pi d^3) (3 (m.n) n - m)."""
    inverse = 1.0 / distance
    n = inverse * separation
    # Cube first: in f32 the square of a moment of 1e-17 A m^2 underflows.
    m = inverse * inverse * inverse * moment
    return mu_0 / (4.0 * ti.math.pi) * (3.0 * m.dot(n) * n - m)


class Dipoles(Pairwise):
    """This is the contract of interactions between dipoles: forces, and fields that magnetise.

    Forces are minus the gradient of an energy only if moments follow the fields of the same sum. Moments are
    therefore refused beside forces with a different sum.

    alike : names of the settings that define the sum.
    """

    contract: ClassVar[bool] = True
    within_bodies: ClassVar[bool] = True
    truncated: ClassVar[bool] = True
    alike: ClassVar[tuple[str, ...]] = ("cutoff", "gap", "shifted")

    def summed(self) -> dict[str, Any]:
        """Return the settings that define the sum, by name."""
        return {name: getattr(self, name, 0) for name in self.alike}

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        if keeps_apart(effects) or any(isinstance(one, PermanentMoment) for one in effects):
            # Contacts are far stiffer; the effect of permanent moments gives its own limit.
            return math.inf
        return None

    def check(self, scene: SceneParts) -> None:
        if not isinstance(self, SelfConsistentQuantity):
            return
        forces = [one for one in scene.effects if isinstance(one, Dipoles) and isinstance(one, PairForce)]
        for other in forces:
            where, theirs = f"effects.{self.label}", other.summed()
            must(self.alike == other.alike, where, "used with forces by the same sum", other.label)
            for name, own in self.summed().items():
                rule = f"that of the forces, {theirs[name]} in effects.{other.label}"
                must(own == theirs[name], f"{where}.{name}", rule, own)

    def beside(self, other: Effect) -> Self:
        if not isinstance(other, Dipoles) or other.alike != self.alike:
            return self
        own = type(self).model_fields
        return self.model_copy(update={name: one for name, one in other.summed().items() if name in own})


class DipolePairs(Dipoles):
    """This is the contract of interactions between dipoles over all pairs, or up to a cut-off.

        d_c = cutoff (R_i + R_j)/2 + gap,    x = d/d_c,    f(x) = 1 plain, 1 - 4 x^3 + 3 x^4 shifted

    The energy of a pair, and the field of one at the other, are the dipole values times f, and 0 beyond d_c.
    With a plain cut-off forces are unchanged inside and jump at d_c; with the shift f(1) = f'(1) = 0, and
    energy, field and force end smoothly.

    Source: the shift is from M. Orsi, D. Y. Haubertin, W. E. Sanderson, J. W. Essex, J. Phys. Chem. B 112
    (2008) 802, lj/sf/dipole/sf in LAMMPS.

    every_pair : whether the cut-off is optional.
    """

    contract: ClassVar[bool] = True
    every_pair: ClassVar[bool] = True

    cutoff: float = parameter(
        "", "cut-off distance of the centres, over the mean radius of the pair; 0 for all pairs", 0.0, ge=0
    )
    gap: float = parameter(
        "m", "length added to the cut-off distance; with a cutoff of 2, the gap between surfaces", 0.0, ge=0
    )
    shifted: bool = option("whether energies, fields and forces go to 0 smoothly at the cut-off", False)

    @model_validator(mode="after")
    def _beyond_contact(self) -> Self:
        apart = self.cutoff > 2 or (self.cutoff == 2 and self.gap > 0)
        rule, every = "greater than 2, or 2 beside a gap", self.every_pair and self.cutoff == self.gap == 0
        rule += ", or 0 without a gap for all pairs" if self.every_pair else ""
        must(apart or every, f"{self.label}.cutoff", rule, self.cutoff)
        must(
            self.short_ranged or not self.shifted,
            f"{self.label}.shifted",
            "false without a cutoff",
            True,
        )
        return self

    @property
    def short_ranged(self) -> bool:  # type: ignore[override]
        """Return whether there is a cut-off."""
        return self.cutoff > 0

    def structure(self) -> tuple[Any, ...]:
        return (*super().structure(), self.short_ranged)

    @ti.func
    def reach(self, s, w, i):
        # Between the surfaces of two as large as i: (cutoff / 2 - 1) (R_i + R_j) + gap.
        return (self.cutoff(w) - 2.0) * s.radius[w, i] + self.gap(w)

    @ti.func
    def part(self, s, w, i, j, distance):
        """Return f, and d f'(d)."""
        part, slope = 1.0 + 0.0 * distance, 0.0 * distance
        if ti.static(self.short_ranged):
            limit = 0.5 * self.cutoff(w) * (s.radius[w, i] + s.radius[w, j]) + self.gap(w)
            if ti.static(self.shifted):
                x = distance / limit
                # 1 - 4 x^3 + 3 x^4 as a product, without cancellation near 1.
                part = (1.0 - x) * (1.0 - x) * (1.0 + 2.0 * x + 3.0 * x * x)
                slope = 12.0 * x * x * x * (x - 1.0)
            part = ti.select(distance <= limit, part, 0.0)
            slope = ti.select(distance <= limit, slope, 0.0)
        return part, slope
