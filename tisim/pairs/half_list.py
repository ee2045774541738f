"""Pairs that short-ranged forces may act between, each listed once, by its smaller particle.

A list is made anew, by the phases below, when particles have moved so far that a pair it lacks could matter;
the skin says how far that is.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import ClassVar

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.domains.domain import Domain
from tisim.effects.base import Constraint, Pairwise
from tisim.numerics.ieee import far_away
from tisim.pairs.cell_grid import LEVELS, OfGrid, OfParticles
from tisim.pairs.cell_phases import cell_phases, measure_phases
from tisim.pairs.neighbour_rows import ALL_PAIRS, NeighbourRows, search_rows
from tisim.program.phases import Phase
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.state.status import WorldStatus

REACH_PART = 0.125
"""Part of the skin that is kept for laws that come to reach farther, as that of particles that grow does."""


@dataclass(frozen=True)
class ListSizes:
    """The list sizes say how much lists of pairs have room for: the pairs that a particle lists for forces,
    those of each particle of a world in the mean, and the pairs that a particle lists for events and step
    control, ``near``.

    Spheres that only touch, of any sizes, touch fewer than 14.93 others in the mean, and make half as many
    pairs (G. Kuperberg and O. Schramm, Math. Res. Lett. 1 (1994) 339). Where laws reach farther the list
    grows when it overflows.
    """

    row: int = 16
    mean: int = 8
    near: int = 16

    def joined(self, other: "ListSizes") -> "ListSizes":
        """Return sizes in which whatever either has room for finds room."""
        largest = map(max, astuple(self), astuple(other))
        return ListSizes(*largest)


@ti.data_oriented
class HalfList(NeighbourRows):
    """A half list has the pairs of the worlds by which laws may act, each row in order of index.

    within_bodies : whether pairs within a rigid body are among them, as a law acts between these.
    solid : whether a law holds spheres apart that touch, which must not pass through each other unseen.
    spent : part of the skin that movements may use up. pace : how far a particle moves in a step (m), found
    from ``moves`` steps since the list was ``made`` (s).
    """

    ordered: ClassVar[bool] = True

    def __init__(
        self,
        s: State,
        domain: Bound[Domain],
        laws: tuple[Bound[Pairwise], ...],
        constraints: tuple[Bound[Constraint], ...],
        sizes: ListSizes,
    ) -> None:
        super().__init__(s, domain, sizes.row)
        self.constraints = constraints
        self.within_bodies = any(law.data.within_bodies for law in laws)
        self.solid = any(law.data.solid for law in laws)
        self.laws, self.sizes = tuple(law for law in laws if law.data.reaches()), sizes
        self.spent = 1.0 - REACH_PART if self.laws else 1.0
        self.pace, self.moves, self.made = ti.field(ti.f64), ti.field(ti.i32), ti.field(ti.f64)
        builder = Builder()
        for column in (self.pace, self.moves, self.made):
            builder.dense(ti.i, s.worlds).place(column)
        self.own = Tree(builder)

    def bytes(self) -> int:
        return super().bytes() + self.own.bytes

    @in_taichi_thread
    def wanted(self) -> ListSizes:
        """Return sizes in which the lists last made, which may have overflowed, have room to spare."""
        mean = -(-5 * int(self.total.to_numpy().max()) // (4 * self.s.capacity))
        return self.sizes.joined(ListSizes(self.wanted_row(), mean))

    @in_taichi_thread
    def outlooks(self, newcomers: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return how far (m) each particle looked from its centre when lists were last made, then how far one
        of each of some radii (m) would, of the worlds for which ``newcomers`` has any."""
        farthest, counts = self.grid.near.to_numpy(), self.s.count.to_numpy()
        most = max(map(len, newcomers))
        later = np.zeros((self.s.worlds, most))
        for row, radius in zip(later, newcomers, strict=False):
            row[: len(radius)] = radius
        if most:
            self._look(later)
        return [
            np.concatenate([farthest[w, : counts[w]], later[w, : len(radius)]])
            for w, radius in enumerate(newcomers)
        ]

    @ti.kernel
    def _look(self, later: ti.types.ndarray()):  # type: ignore[valid-type]
        """Put how far particles of these radii (m) look in place of them; each is in turn what a world has
        room for beyond its last particle."""
        for w in range(self.s.worlds):
            for k in range(later.shape[1]):
                i = self.s.count[w]
                if later[w, k] > 0.0:
                    self.s.radius[w, i] = ti.cast(later[w, k], self.s.real)
                    later[w, k] = ti.cast(self.s.radius[w, i] + self.reach(w, i), ti.f64)

    def forget(self) -> None:
        """Have every list made anew before it is used again, as the first of a run: nothing is known of how
        fast particles move."""
        super().forget()
        self.moves.fill(0)
        self.pace.fill(0.0)

    @ti.func
    def reach(self, w, i):
        return self.reach_of(self.laws, w, i)

    @ti.func
    def reach_of(self, laws: ti.template(), w, i):  # type: ignore[valid-type]
        """Return the widest gap (m) at which one of these laws acts between i and a particle no larger."""
        gap = ti.cast(0.0, self.s.real)
        for law in ti.static(laws):
            gap = ti.max(gap, law.reach(self.s, w, i))
        return gap

    @ti.func
    def widest(self, laws: ti.template(), w, i, j):  # type: ignore[valid-type]
        """Return the widest distance (m) at which one of these laws, which act beyond contact, or contact
        itself, acts between two; beyond all in a world that looks at all."""
        s, distance = self.s, self.s.radius[w, i] + self.s.radius[w, j]
        if ti.static(len(laws) > 0):
            a, b = s.radius[w, i], s.radius[w, j]
            first, second = self.reach_of(laws, w, i), self.reach_of(laws, w, j)
            distance += ti.select(a > b, first, ti.select(b > a, second, ti.max(first, second)))
        return ti.select(s.listed_above[w] >= ALL_PAIRS, ti.static(far_away()), distance)

    @ti.func
    def lists(self, w, i, j):
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a < b or (a == b and self.s.id[w, i] < self.s.id[w, j])

    @ti.func
    def leaves_out(self, w, i, j):
        left_out = False
        if ti.static(not self.within_bodies):
            left_out = self.joined(w, i, j)
        return left_out

    @ti.func
    def joined(self, w, i, j):
        """Return whether the pair is within a rigid body."""
        joined = False
        for constraint in ti.static(self.constraints):
            joined = joined or constraint.joined(self.s, w, i, j)
        return joined

    @ti.func
    def sees(self, d, distance, skin):
        limit = distance + skin[0]
        return d.norm_sqr() <= limit * limit

    @ti.func
    def moved(self, w):
        """Note that particles have moved by at most ``displacement`` relative to the frame, along each
        axis."""
        square, step = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        self.moves[w] = self.moves[w] + 1
        for k in ti.static(range(3)):
            self.since[w, k] = self.since[w, k] + self.s.displacement[w, k]
            square += self.since[w, k] ** 2
            step += self.s.displacement[w, k] ** 2
        # Two that meet head on move past each other by twice as much. A list that has just been made longer
        # does not know the smallest radius yet, and is about to be made anew.
        smallest = ti.cast(self.grid.smallest[w], ti.f64)
        if ti.static(self.solid):
            outrun = smallest > 0.0 and step > smallest * smallest
            if outrun and self.s.count[w] > 1:
                ti.atomic_max(self.s.failed[w], WorldStatus.OUTRUN)
        apart = 2.0 * ti.sqrt(square)
        if ti.static(self.images > 0):
            apart += self.sheared(w, self.s.time[w] + self.s.dt[w] - self.made[w])
        if not (apart <= self.spent * self.grid.skin[w, 0]):
            self.stale[w] = 1

    @ti.func
    def sheared(self, w, elapsed):
        """Return how far (m) shear alone may move two near particles past each other in a time (s)."""
        g, widest = self.grid, ti.cast(0.0, self.s.real)
        for level in range(LEVELS):
            widest = ti.max(widest, g.largest[w, level] + g.widest[w, level])
        return ti.abs(ti.cast(g.domain.shear_rate(w), ti.f64)) * elapsed * (widest + g.skin[w, 0])


REBUILD_COST = 100.0
"""Making a list takes, for each particle, as long as this many listed pairs take in a step that do not act on
each other. Measured in a bed of grains (docs/performance.md): some 900 ns beside 9."""
LEAST_SKIN, MOST_SKIN = 0.01, 0.5
"""These bound the skin, in distances at which two of the smallest particles see each other."""
FEWEST_PAIRS = 1.0
"""So many pairs of each particle are taken to see each other, where there are fewer: they may come to."""


def watch_reach(half_list: HalfList) -> tuple[Phase, ...]:
    """Return the phase that finds out whether laws have come to reach farther, where they reach beyond
    contact at all."""
    return (WatchReach(half_list),) if half_list.laws else ()


def rebuild_half_list(half_list: HalfList) -> tuple[Phase, ...]:
    """Return the phases that make the list anew."""
    grid = half_list.grid
    measure = (*measure_phases(grid, half_list), ChooseSkin(half_list))
    return (*measure, *cell_phases(grid), *search_rows(half_list))


class ChooseSkin(OfGrid):
    """This phase sets the skin: that of the scene, or the one with which steps should cost least.

    A wider skin makes lists last longer, in proportion, and longer to go through. Particles that move by u in
    a step take, of n pairs each that see each other within D, with a skin b

        2 u / b * REBUILD_COST + n (1 + b/D)^3

    times what a pair costs, which is least where b (1 + b/D) = sqrt(2 u D REBUILD_COST / 3 n). Both u and n
    are counts of the list before. No clock is asked, so a run makes its lists in the same steps again.
    """

    def __init__(self, half_list: HalfList) -> None:
        super().__init__(half_list.grid)
        self.n = half_list

    @ti.func
    def run(self, w, _k):
        g, n, s = self.g, self.n, self.s
        square = ti.cast(0.0, ti.f64)
        for k in ti.static(range(3)):
            square += n.since[w, k] ** 2
            n.since[w, k] = 0.0
        apart = 2.0 * ti.sqrt(square)
        if ti.static(n.images > 0):
            apart += n.sheared(w, s.time[w] - n.made[w])
        if n.moves[w] > 0:
            n.pace[w] = 0.5 * apart / n.moves[w]
        n.moves[w], n.made[w] = 0, s.time[w]
        chosen = ti.cast(s.skin[w], s.real)
        if chosen <= 0.0:
            distance = g.largest[w, 0] + g.widest[w, 0]
            wider = 1.0 + g.skin[w, 0] / distance
            near = ti.cast(n.total[w], s.real) / (s.count[w] * wider * wider * wider)
            pace = ti.cast(n.pace[w], s.real) / n.spent
            best = pace * REBUILD_COST / (1.5 * distance * ti.max(near, FEWEST_PAIRS))
            part = 0.5 * (ti.sqrt(1.0 + 4.0 * ti.sqrt(best)) - 1.0)
            chosen = distance * ti.max(LEAST_SKIN, ti.min(part, MOST_SKIN))
        for k in ti.static(range(3)):
            g.skin[w, k] = chosen


class WatchReach(OfParticles):
    """This phase has the list made anew where particles look farther than it was made for."""

    def __init__(self, half_list: HalfList) -> None:
        super().__init__(half_list.grid)
        self.n = half_list

    @ti.func
    def run(self, w, i):
        g = self.g
        farther = self.s.radius[w, i] + self.n.reach(w, i) - g.near[w, i]
        if farther > 0.5 * REACH_PART * g.skin[w, 0]:
            self.n.stale[w] = 1
