"""The neighbour lists of a scene, combined in one object for steppers and operators."""

from dataclasses import replace
from typing import TYPE_CHECKING

from tisim.backend.taichi import ti
from tisim.pairs.half_list import ListSizes
from tisim.pairs.near_list import NearList
from tisim.pairs.neighbour_rows import NeighbourRows
from tisim.state.state import State
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from tisim.pairs.pair_chunks import PairChunks


@ti.data_oriented
class NeighbourLists:
    """The neighbour lists of a scene: ``near`` for events and step control, and ``pairs`` for short-ranged
    forces.

    They must be told how far particles have moved.
    """

    def __init__(self, s: State, near: NearList | None, pairs: "PairChunks | None") -> None:
        self.s, self.near, self.pairs = s, near, pairs
        self.watched, self.listed = near is not None, pairs is not None
        self.lists = tuple(one for one in (near, pairs) if one is not None)

    @ti.func
    def moved(self, w):
        """Record that particles have moved by at most ``displacement`` relative to the frame, along each
        axis. The world fails if particles may have passed through each other."""
        if self.tried(w):
            ti.atomic_max(self.s.failed[w], WorldStatus.OUTRUN)

    @ti.func
    def tried(self, w):
        """Record the displacement of an attempt at a step, as ``moved`` does, and return whether particles
        may have passed through each other."""
        for one in ti.static(self.lists):
            one.moved(w)
        passing = False
        if ti.static(self.listed):
            passing = self.pairs.half_list.outrun(w)
        return passing

    @ti.func
    def invalidate(self, w):
        """Have all lists rebuilt, because particles have been moved other than by a step."""
        for one in ti.static(self.lists):
            one.invalidate(w)

    @ti.func
    def sure(self, w):
        """Return the gap (m) between surfaces within which the step control gets all pairs; 0 stands for no
        limit."""
        gap = ti.cast(0.0, self.s.real)
        if ti.static(self.watched):
            gap = self.near.sure(w)
        return gap

    def rows(self) -> tuple[NeighbourRows, ...]:
        """Return the rows of each list."""
        return tuple(one if isinstance(one, NeighbourRows) else one.half_list for one in self.lists)

    def forget(self) -> None:
        """Have all lists rebuilt before their next use."""
        for one in self.lists:
            one.forget()

    def wanted(self, sizes: ListSizes) -> ListSizes:
        """Return sizes, at least ``sizes``, with spare room for the lists as last made, which may have
        overflowed."""
        if self.pairs is not None:
            sizes = sizes.joined(self.pairs.half_list.wanted())
        if self.near is not None:
            sizes = replace(sizes, near=max(sizes.near, self.near.wanted_row()))
        return sizes
