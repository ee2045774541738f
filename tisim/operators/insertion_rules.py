"""The insertions: by a flux, and by the part of a region that grains fill."""

from __future__ import annotations

from typing import Literal

from tisim.backend.taichi import ti
from tisim.operators.base import option, parameter
from tisim.operators.filled_part import FilledPart
from tisim.operators.insertion import MOST_TRIES, Insertion


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

    def unit_as_set(self, name: str) -> str:
        return "1/s" if name == "flux" and self.by == "number" else super().unit_as_set(name)

    @ti.func
    def acts(self, s, w):
        return ti.cast(self.is_wanted(s, w), ti.i32)

    @ti.func
    def pending(self, s, w):
        return ti.cast(self.inserted[w] < self.number, ti.i32)

    @ti.func
    def is_wanted(self, s, w):
        """Return whether the next grain is due."""
        so_far = self.inserted[w]
        if ti.static(self.by == "mass"):
            so_far = self.inserted_mass[w]
        elapsed = s.time[w] - ti.cast(self.begin(w), ti.f64)
        due = so_far < ti.cast(self.flux(w), ti.f64) * elapsed
        return due and self.inserted[w] < self.number

    @ti.func
    def world(self, s, w):
        self.seek(s, w)


class InsertionByFraction(FilledPart, Insertion):
    """Grains are put into a region until they fill a given part of its volume, now and again.

    At ``begin``, and whenever an ``interval`` has passed, grains are put in until those whose centres are in
    the region have the ``fraction`` of its volume, or until one finds no place. At random places the fraction
    of equal spheres comes to 0.3 with some thousand tries, and to 0.38 with no number of them. It is what
    LIGGGHTS has as ``fix insert/pack``. For ``at_rest`` it is done after the first filling: whether there
    will be room for more, nobody knows.
    """

    interval: float = parameter("s", "time from one filling to the next", gt=0, examples=[1.0])
    tries: int = option("places that are tried for a grain", 1000, gt=0, le=MOST_TRIES)

    @ti.func
    def elapsed(self, s, w):
        # The first interval counts when it begins.
        return (s.time[w] - ti.cast(self.begin(w), ti.f64)) / ti.cast(self.interval(w), ti.f64) + 1.0

    @ti.func
    def pending(self, s, w):
        return ti.cast(self.counted[w] == 0, ti.i32)

    @ti.func
    def is_wanted(self, s, w):
        return self.action.filled[w] < self.enough(s, w) and self.inserted[w] < self.number

    @ti.func
    def world(self, s, w):
        self.count_interval(s, w)
        self.action.filled[w] = self.sums.total(w)[0]
        self.seek(s, w)
