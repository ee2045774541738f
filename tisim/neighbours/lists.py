"""The lists of near pairs that a scene calls for, as steppers and operators see them: one object for all."""

from typing import Any

from tisim.backend.taichi import ti
from tisim.neighbours.pair_list import NeighbourList
from tisim.worlds.state import State


@ti.data_oriented
class NeighbourLists:
    """The neighbour lists have to hear how far particles have moved: the list of events and step control,
    ``near``, and the pairs of short-ranged forces."""

    def __init__(self, s: State, near: NeighbourList | None, pairs: Any | None) -> None:
        self.s, self.near, self.watched = s, near, near is not None
        self.lists = tuple(one for one in (near, pairs) if one is not None)

    @ti.func
    def moved(self, w):
        """Note that particles have moved by at most ``displacement`` relative to the frame, along each
        axis."""
        for one in ti.static(self.lists):
            one.moved(w)

    @ti.func
    def invalidate(self, w):
        """Have all lists made anew: particles have been put elsewhere."""
        for one in ti.static(self.lists):
            one.invalidate(w)

    @ti.func
    def sure(self, w):
        """Return the gap (m) between surfaces within which all pairs are offered to the step control; 0, for
        no limit, where all pairs are."""
        gap = ti.cast(0.0, self.s.real)
        if ti.static(self.watched):
            gap = self.near.sure(w)
        return gap

    def forget(self) -> None:
        """Have all lists made anew before they are used again."""
        for one in self.lists:
            one.forget()
