"""Sudden events between two particles."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base.effect import Effect


class PairEvent(Effect):
    """A pair event is something sudden between two particles, such as an impact.

    hard : whether its particles are hard spheres, which may touch but not lie in each other: a world stops in
        which that is true of more pairs than can touch.
    """

    contract: ClassVar[bool] = True
    hard: ClassVar[bool] = False

    @ti.func
    def contact(self, s, w, i, j, separation):
        """Return how long ago (s) the event between i and j fell due; something negative when it has not.

        ``separation`` is r_j - r_i (m). It is called for every near pair in every step.
        """
        return -1.0

    @ti.func
    def resolve(self, s, w, i, j, separation):
        """Change i and j, which no other event changes at the same time."""
