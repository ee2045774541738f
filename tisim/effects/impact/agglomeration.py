"""Agglomeration: two bonded grains become one sphere (Z04 remark 2.1)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.impact.impact import Impact
from tisim.effects.impact.law import ImpactLaw
from tisim.numerics import elementary
from tisim.state.fields import WorldField


class Agglomeration(ImpactLaw):
    """Two grains that bond in an impact merge into one sphere and conserve mass, momentum, volume and heat.

        b = (b_i^3 + b_j^3)^(1/3),    at the centre of mass of the two

    Each quantity of a particle follows its own rule (tisim.state.fields.Field.merge): sums are added, means
    are weighted by mass, the radius b follows from the volume.

    Source: Z04 remark 2.1.
    """

    world_fields = (WorldField("merges", "counter"),)
    requires: ClassVar = (Impact,)

    @ti.func
    def bond(self, s, w, i, j, separation):
        share = s.mass[w, j] / (s.mass[w, i] + s.mass[w, j])
        s.position[w, i] = s.position[w, i] + share * separation
        for field in ti.static(s.means):
            field[w, i] = field[w, i] + share * (field[w, j] - field[w, i])
        s.radius[w, i] = elementary.pow(s.radius[w, i] ** 3 + s.radius[w, j] ** 3, 1.0 / 3.0)
        for field in ti.static(s.sums):
            field[w, i] = field[w, i] + field[w, j]
        s.remove(w, j)
        ti.atomic_add(s.merges[w], 1)
