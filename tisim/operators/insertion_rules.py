"""The insertions: by a flux, and by the part of a region that grains fill."""

from __future__ import annotations

from typing import Any, Literal

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint
from tisim.operators.base import option, parameter
from tisim.operators.insertion import MOST_TRIES, Insertion
from tisim.worlds.bound import Peers


class InsertionByFlux(Insertion):
    """Grains come into a region at a given flux, until there are as many as asked for.

        a grain is due at t when those before it are less than flux * (t - begin)

    by mass, or by number. Where the region is full they wait, and come as soon as there is room: put it where
    grains fall out of it, or give them a velocity. It is what LAMMPS has as ``fix pour``, and LIGGGHTS as
    ``fix insert/rate/region``.
    """

    flux: float = parameter(
        "kg/s", "mass that comes in each second; in 1/s where it is by number", gt=0, examples=[0.1]
    )
    by: Literal["mass", "number"] = option(
        "what the flux is of: the mass of the grains, or their number", "mass"
    )

    @ti.func
    def acts(self, s, w):
        return ti.cast(self.is_due(s, w), ti.i32)

    @ti.func
    def pending(self, s, w):
        return ti.cast(self.inserted[w] < self.number, ti.i32)

    @ti.func
    def is_due(self, s, w):
        """Return whether the next grain is due."""
        so_far = self.inserted[w]
        if ti.static(self.by == "mass"):
            so_far = self.inserted_mass[w]
        elapsed = s.time[w] - ti.cast(self.begin(w), ti.f64)
        due = so_far < ti.cast(self.flux(w), ti.f64) * elapsed
        return due and self.inserted[w] < self.number

    @ti.func
    def world(self, s, w):
        placed = True
        while placed and self.is_due(s, w):
            placed = self.insert(s, w) > 0.0


class InsertionByFraction(Insertion):
    """Grains are put into a region until they fill a given part of its volume, now and again.

    At ``begin``, and whenever an ``interval`` has passed, grains are put in until those whose centres are in
    the region have the ``fraction`` of its volume, or until one finds no place. At random places the fraction
    of equal spheres comes to 0.3 with some thousand tries, and to 0.38 with no number of them. It is what
    LIGGGHTS has as ``fix insert/pack``. For ``at_rest`` it is done after the first filling: whether there
    will be room for more, nobody knows.
    """

    fraction: float = parameter("", "part of the region's volume that is filled", gt=0, lt=1, examples=[0.2])
    interval: float = parameter("s", "time from one filling to the next", gt=0, examples=[1.0])
    tries: int = option("places that are tried for a grain", 1000, gt=0, le=MOST_TRIES)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"constraints": peers.of(Constraint)}

    @ti.func
    def acts(self, s, w):
        begin, interval = ti.cast(self.begin(w), ti.f64), ti.cast(self.interval(w), ti.f64)
        before = s.time[w] - s.dt[w]
        due = ti.floor((s.time[w] - begin) / interval) > ti.floor((before - begin) / interval)
        first = s.time[w] >= begin and (before < begin or before <= 0.0)
        due = (due and before >= begin) or first
        return ti.cast(due and self.inserted[w] < self.number, ti.i32)

    @ti.func
    def pending(self, s, w):
        return ti.cast(s.time[w] <= self.begin(w), ti.i32)

    @ti.func
    def world(self, s, w):
        filled = 0.0 * s.radius[w, 0]
        for i in range(s.count[w]):
            filled += self.cube(s, w, i)
        most = self.fraction(w) * self.volume(w) / ti.cast(4.0 / 3.0 * ti.math.pi, s.real)
        placed = True
        while placed and filled < most and self.inserted[w] < self.number:
            radius = self.insert(s, w)
            filled += radius**3
            placed = radius > 0.0

    @ti.func
    def cube(self, s, w, i):
        """Return the cube of the radius (m^3) of a ball of the volume of the grain that particle i stands
        for, where its centre is in the region; else 0."""
        place, cube = s.position[w, i], s.radius[w, i] ** 3
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i):
                place, cube = constraint.home(s, w, i), 0.0 * cube
                if constraint.leads(s, w, i):
                    cube = constraint.volume(s, w, i) / ti.cast(4.0 / 3.0 * ti.math.pi, s.real)
        if s.mass[w, i] == 0.0 or not self.contains(w, place):
            cube = 0.0 * cube
        return cube
