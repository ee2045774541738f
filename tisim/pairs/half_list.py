"""Pairs for short-ranged forces, each listed once, by its smaller particle.

The phases below rebuild a list when particles have moved so far that a missing pair could interact; the skin
sets this distance.
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
from tisim.effects.base import Constraint, Pairwise, Shaped
from tisim.numerics.ieee import far_away
from tisim.pairs.cell_grid import LEVELS, OfGrid, OfParticles
from tisim.pairs.cell_phases import cell_phases, measure_phases
from tisim.pairs.neighbour_rows import ALL_PAIRS, NeighbourRows, search_rows
from tisim.program.phases import Phase
from tisim.state.bound import Bound
from tisim.state.state import State

REACH_PART = 0.125
"""Fraction of the skin reserved for interaction ranges that increase, for example of growing particles."""


@dataclass(frozen=True)
class ListSizes:
    """The list sizes are the capacities of the pair lists.

    row : pairs that one particle lists for forces. mean : mean number of listed pairs for each particle of a
    world. near : pairs that one particle lists for events and step control.

    Spheres of any sizes that only touch have fewer than 14.93 contacts on average, which makes half this
    number of pairs per particle (G. Kuperberg and O. Schramm, Math. Res. Lett. 1 (1994) 339). For longer
    interaction ranges a list grows when it overflows.
    """

    row: int = 16
    mean: int = 8
    near: int = 16

    def joined(self, other: "ListSizes") -> "ListSizes":
        """Return the larger of both sizes, one by one."""
        largest = map(max, astuple(self), astuple(other))
        return ListSizes(*largest)


@ti.data_oriented
class HalfList(NeighbourRows):
    """A half list has the pairs of every world that laws may act between, with each row sorted by index.

    within_bodies : whether pairs within a rigid body are listed, because a law acts between them.
    solid : whether a law holds touching spheres apart, so that they must not pass through each other
    undetected.
    spent : fraction of the skin that movement may use up.
    pace : displacement of a particle in a step (m), averaged over ``moves`` steps since the list was ``made``
    (s).
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
        self.shaped = tuple(one for one in (*laws, *constraints) if isinstance(one.data, Shaped))
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
        """Return sizes with spare room for the lists as last made, which may have overflowed."""
        mean = -(-5 * int(self.total.to_numpy().max()) // (4 * self.s.capacity))
        return self.sizes.joined(ListSizes(self.wanted_row(), mean))

    @in_taichi_thread
    def search_radii(self, inserted: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the search radii (m) of the particles when the lists were last made, then the radii for
        inserted particles.

        inserted : radii (m) of the particles that may be inserted, for each world that is asked for.
        """
        farthest, counts = self.grid.near.to_numpy(), self.s.count.to_numpy()
        most = max(map(len, inserted))
        later = np.zeros((self.s.worlds, most))
        for row, radius in zip(later, inserted, strict=False):
            row[: len(radius)] = radius
        if most:
            self._look(later)
        return [
            np.concatenate([farthest[w, : counts[w]], later[w, : len(radius)]])
            for w, radius in enumerate(inserted)
        ]

    @ti.kernel
    def _look(self, later: ti.types.ndarray()):  # type: ignore[valid-type]
        """Replace radii (m) by the search radii (m) of particles of that size. Each is placed in the slot
        after the last particle to compute it."""
        for w in range(self.s.worlds):
            for k in range(later.shape[1]):
                i = self.s.count[w]
                if later[w, k] > 0.0:
                    self.s.radius[w, i] = ti.cast(later[w, k], self.s.real)
                    later[w, k] = ti.cast(self.s.radius[w, i] + self.reach(w, i), ti.f64)

    def forget(self) -> None:
        """Have every list rebuilt before its next use and, as in a new run, discard the measured speed of the
        particles."""
        super().forget()
        self.moves.fill(0)
        self.pace.fill(0.0)

    @ti.func
    def reach(self, w, i):
        return self.reach_of(self.laws, w, i)

    @ti.func
    def reach_of(self, laws: ti.template(), w, i):  # type: ignore[valid-type]
        """Return the largest gap (m) at which one of these laws acts between i and a particle of equal or
        smaller size."""
        gap = ti.cast(0.0, self.s.real)
        for law in ti.static(laws):
            gap = ti.max(gap, law.reach(self.s, w, i))
        return gap

    @ti.func
    def widest(self, laws: ti.template(), w, i, j):  # type: ignore[valid-type]
        """Return the largest distance (m) at which one of these laws, or contact, acts between two particles.

        It exceeds every distance in a world that lists all pairs.
        """
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
    def leaves_out(self, w, i, j, d, skin):
        left_out = False
        if ti.static(not self.within_bodies):
            left_out = self.joined(w, i, j)
        for one in ti.static(self.shaped):
            gap = skin[0] + ti.max(self.reach(w, i), self.reach(w, j))
            left_out = left_out or one.apart(self.s, w, i, j, d, gap)
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
        """Record that particles have moved by at most ``displacement`` relative to the frame, along each
        axis."""
        square = ti.cast(0.0, ti.f64)
        self.moves[w] = self.moves[w] + 1
        for k in ti.static(range(3)):
            self.since[w, k] = self.since[w, k] + self.s.displacement[w, k]
            square += self.since[w, k] ** 2
        apart = 2.0 * ti.sqrt(square)
        if ti.static(self.images > 0):
            apart += self.sheared(w, self.s.time[w] + self.s.dt[w] - self.made[w])
        if not (apart <= self.spent * self.grid.skin[w, 0]):
            self.stale[w] = 1

    @ti.func
    def outrun(self, w):
        """Return whether solid particles that move by ``displacement`` may pass through each other."""
        passing = False
        if ti.static(self.solid):
            step = ti.cast(0.0, ti.f64)
            for k in ti.static(range(3)):
                step += self.s.displacement[w, k] ** 2
            # Two particles that move towards each other approach by twice the displacement. The smallest
            # radius is unknown in a list that was just lengthened and is about to be rebuilt.
            smallest = ti.cast(self.grid.smallest[w], ti.f64)
            for one in ti.static(self.shaped):
                # Bodies are thinner than the spheres around them.
                smallest *= ti.cast(one.slenderness(w, 0), ti.f64)
            passing = smallest > 0.0 and step > smallest * smallest and self.s.count[w] > 1
        return passing

    @ti.func
    def sheared(self, w, elapsed):
        """Return the distance (m) by which shear alone may displace two near particles in a time (s)."""
        g, widest = self.grid, ti.cast(0.0, self.s.real)
        for level in range(LEVELS):
            widest = ti.max(widest, g.largest[w, level] + g.widest[w, level])
        return ti.abs(ti.cast(g.domain.shear_rate(w), ti.f64)) * elapsed * (widest + g.skin[w, 0])


REBUILD_COST = 100.0
"""Cost of a list rebuild per particle, in steps of a listed pair that does not interact.

Measured in a bed of grains (docs/performance.md): some 900 ns against 9 ns.
"""
LEAST_SKIN, MOST_SKIN = 0.01, 0.5
"""Bounds of the skin, relative to the interaction distance of two of the smallest particles."""
FEWEST_PAIRS = 1.0
"""Least assumed number of interacting pairs per particle, as their number may rise later."""


def watch_reach(half_list: HalfList) -> tuple[Phase, ...]:
    """Return the phase that detects increased interaction ranges, if any law acts beyond contact."""
    return (WatchReach(half_list),) if half_list.laws else ()


def rebuild_half_list(half_list: HalfList) -> tuple[Phase, ...]:
    """Return the phases that rebuild the list."""
    grid = half_list.grid
    measure = (*measure_phases(grid, half_list), ChooseSkin(half_list))
    return (*measure, *cell_phases(grid), *search_rows(half_list))


class ChooseSkin(OfGrid):
    """This phase sets the skin: the skin of the scene, or the one that minimizes the estimated cost.

    A wider skin makes lists last longer, in proportion, but adds pairs to scan. For particles that move by u
    in a step and have n pairs each within the interaction distance D, the cost of a step with a skin b is

        2 u / b * REBUILD_COST + n (1 + b/D)^3

    times the cost of a pair. It is smallest for b (1 + b/D) = sqrt(2 u D REBUILD_COST / 3 n). Both u and n
    are taken from the previous list. No clock is read, so repeated runs rebuild their lists in the same
    steps.
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
    """This phase marks the list for a rebuild if the interaction range of a particle exceeds the range it was
    made for."""

    def __init__(self, half_list: HalfList) -> None:
        super().__init__(half_list.grid)
        self.n = half_list

    @ti.func
    def run(self, w, i):
        g = self.g
        farther = self.s.radius[w, i] + self.n.reach(w, i) - g.near[w, i]
        if farther > 0.5 * REACH_PART * g.skin[w, 0]:
            self.n.stale[w] = 1
