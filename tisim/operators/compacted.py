"""Compacted: a run ends when its grains fill a given part of a region, instead of at a fixed time."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.operators.base import parameter
from tisim.operators.filled_part import FilledPart
from tisim.state.fields import WorldField


class Compacted(FilledPart):
    """A world ends when its grains fill a region to a given part of its volume, for example under a servo
    wall.

        4/3 pi sum_i R_i^3  >=  fraction * V

    The sum is over the grains whose centres are in the region, after the first step of every ``interval``;
    the run ends at the ``duration`` of the scene at the latest. Keep the region a few grains away from walls,
    because near a wall there is less room for centres. The filled fraction at the last check is in
    ``measures`` as ``filled_fraction``.
    """

    world_fields = (WorldField("filled_fraction", "measure"),)
    any_order: ClassVar[bool] = True
    fields = ("radius",)
    ends: ClassVar = "grains fill the region"

    interval: float = parameter("s", "time between two checks of the region", gt=0, examples=[1e-3])

    @ti.func
    def world(self, s, w):
        self.count_interval(s, w)
        filled, enough = self.sums.total(w)[0], self.enough(s, w)
        s.filled_fraction[w] = self.fraction(w) * (filled / enough)
        if not finite(s.filled_fraction[w]):
            s.fail_world_by_effect(w, self.index)
        elif filled >= enough:
            s.finish(w, self.index)
