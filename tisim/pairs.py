"""Sums over the other particles, in a fixed order; they know no physics."""

from collections.abc import Sequence
from typing import Any

from tisim._taichi import ti
from tisim.domain import Domain
from tisim.halves import Halves
from tisim.program import PerParticle
from tisim.state import State


class PairSum(PerParticle):
    """For each particle a sum over the others: all of them, or those near enough to be listed.

    A subclass says what one other contributes, in ``term``.
    """

    def __init__(self, s: State, domain: Domain, effects: Sequence[Any], halves: Halves | None) -> None:
        super().__init__(s)
        self.domain, self.halves = domain, halves
        self.long_ranged = tuple(e for e in effects if not e.short_ranged)
        self.short_ranged = tuple(e for e in effects if e.short_ranged)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        """What j contributes to the sum of i; a vector as long as the sum."""
        return 0.0 * separation

    @ti.func
    def summed(self, total, w, i, t):
        """``total`` and the terms of all others."""
        if ti.static(len(self.long_ranged) > 0):
            for j in range(self.s.count[w]):
                total += self.of(self.long_ranged, 0.0 * total, w, i, j, t)
        if ti.static(len(self.short_ranged) > 0):
            for k in range(self.halves.size(w, i)):
                total += self.of(self.short_ranged, 0.0 * total, w, i, self.halves.candidate(w, i, k), t)
        return total

    @ti.func
    def of(self, effects: ti.template(), nothing, w, i, j, t):  # type: ignore[valid-type]
        """Terms of j for i; none of itself."""
        total = nothing
        if i != j:
            d = self.domain.separation(w, self.s.position[w, i], self.s.position[w, j])
            distance = d.norm()
            for effect in ti.static(effects):
                total += self.term(effect, w, i, j, d, distance, t)
        return total
