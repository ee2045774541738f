"""Sudden events between two particles."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base.effect import Effect


class PairEvent(Effect):
    """A pair event is a sudden change of two particles, such as an impact.

    hard : whether its particles are hard spheres, which may touch but not overlap. A world stops if more
    pairs overlap than can touch.
    """

    contract: ClassVar[bool] = True
    hard: ClassVar[bool] = False

    @ti.func
    def contact(self, s, w, i, j, separation):
        """Return the time (s) since the event between i and j became due; negative if it is not due.

        ``separation`` is r_j - r_i (m). It is called for every near pair in every step.
        """
        return -1.0

    @ti.func
    def resolve(self, s, w, i, j, separation):
        """Change i and j; no other event changes them at the same time."""
