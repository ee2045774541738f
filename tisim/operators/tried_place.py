"""The insertion trials for the next grain: all particles are checked for overlap in parallel."""

from __future__ import annotations

from typing import Any

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.program.phases import Item, Phase, Repeat, WorldAction
from tisim.state.bound import Bound
from tisim.state.state import State

COMPARED_TOGETHER = {"cpu": 1024}
"""Number of particles in a block, 64 on other devices; the spheres of the grain are rotated once per
block."""


@ti.data_oriented
class TriedPlace(WorldAction):
    """Insertion trials choose places for the next grain of each world, grain after grain, until no more
    grains are wanted or all trials of a grain have failed.

    seeking : whether a grain is being placed. attempt : number of failed trials for it. taken : whether its
    place overlaps a particle. drawn : its class. radius (m), velocity (m/s), place (m) and orientation :
    properties of the grain. filled : sum of the cubes of the radii of grains (m^3), for insertions by
    fraction.
    """

    def __init__(self, insertion: Bound[Any], s: State) -> None:
        self.insertion, self.s = insertion, s
        self.seeking, self.attempt, self.taken, self.drawn = (ti.field(ti.i32) for _ in range(4))
        self.radius, self.filled = ti.field(s.real), ti.field(ti.f64)
        self.place, self.velocity = (ti.Vector.field(3, s.real) for _ in range(2))
        self.orientation = ti.Vector.field(4, s.real)
        builder = Builder()
        for column in (self.seeking, self.attempt, self.taken, self.drawn, self.radius, self.filled):
            builder.dense(ti.i, s.worlds).place(column)
        for vector in (self.place, self.velocity, self.orientation):
            builder.dense(ti.i, s.worlds).place(vector)
        self.tree = Tree(builder)

    def phases(self) -> tuple[Item, ...]:
        return (TryPlaces(self),)

    def bytes(self) -> int:
        return self.tree.bytes


class TryPlaces(Repeat):
    """This repeat performs one insertion trial in each turn."""

    usual = 0

    def __init__(self, tried: TriedPlace) -> None:
        super().__init__((ChoosePlace(tried), LookForOverlap(tried), EndTry(tried)))
        self.tried = tried

    @ti.func
    def pending(self, w):
        return self.tried.seeking[w]


class ChoosePlace(Phase):
    """This phase chooses the place of a trial."""

    def __init__(self, tried: TriedPlace) -> None:
        self.tried, self.insertion, self.s = tried, tried.insertion, tried.s

    @ti.func
    def run(self, w, _k):
        self.insertion.choose_place(self.s, w)


class LookForOverlap(Phase):
    """This phase searches each block of particles for one that overlaps the grain, until one is found."""

    light = False

    def __init__(self, tried: TriedPlace) -> None:
        self.tried, self.insertion, self.s = tried, tried.insertion, tried.s
        self.block = COMPARED_TOGETHER.get(runtime.current().device, 64)
        self.extent = -(-self.s.capacity // self.block)

    @ti.func
    def size(self, w):
        return (self.s.count[w] + self.block - 1) // self.block

    @ti.func
    def run(self, w, b):
        begin, end = b * self.block, ti.min((b + 1) * self.block, self.s.count[w])
        if self.tried.taken[w] == 0 and self.overlaps(w, begin, end):
            ti.atomic_max(self.tried.taken[w], 1)

    @ti.func
    def overlaps(self, w, begin, end):
        """Return whether a sphere of the grain overlaps any of a range of particles."""
        s, tried = self.s, self.tried
        c, q, radius = tried.drawn[w], tried.orientation[w], tried.radius[w]
        m, found = self.insertion.first_sphere(c), False
        while m < self.insertion.end_sphere(c) and not found:
            at = tried.place[w] + self.insertion.arm(m, q, radius)
            size = self.insertion.sphere_radius(m, radius)
            j = begin
            while j < end and not found:
                apart = s.domain.nearest(w, at, s.position[w, j], s.time[w])
                least = size + s.radius[w, j]
                found = apart.norm_sqr() < least * least and s.mass[w, j] > 0.0
                j += 1
            m += 1
        return found


class EndTry(Phase):
    """This phase inserts the grain if its place is free, and otherwise goes on to the next trial."""

    def __init__(self, tried: TriedPlace) -> None:
        self.insertion, self.s = tried.insertion, tried.s

    @ti.func
    def run(self, w, _k):
        self.insertion.end_try(self.s, w)
