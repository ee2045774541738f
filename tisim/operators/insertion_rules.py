"""The insertions: by a flux, and by the filled fraction of a region."""

from __future__ import annotations

from typing import Literal

from tisim.backend.taichi import ti
from tisim.operators.base import option, parameter
from tisim.operators.filled_part import FilledPart
from tisim.operators.insertion import MOST_TRIES, Insertion


class InsertionByFlux(Insertion):
    """Grains are inserted into a region at a given flux, up to a given number.

        a grain is due at t when those before it are less than flux * (t - begin)

    The amount is a mass or a number. Grains that are due wait while the region is full, and come as soon as
    there is room. Place the region so that grains fall out of it, or give them a velocity. LAMMPS has this as
    ``fix pour``, and LIGGGHTS as ``fix insert/rate/region``.
    """

    flux: float = parameter(
        "kg/s",
        "inserted mass per second, in kg/s; number per second, in 1/s, if by is number",
        gt=0,
        examples=[0.1],
    )
    by: Literal["mass", "number"] = option(
        "quantity that the flux measures: mass or number of the grains", "mass"
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
    """Grains are inserted at intervals until they fill a given fraction of a region's volume.

    At ``begin`` and after each ``interval``, grains are inserted until the grains whose centres are in the
    region have the ``fraction`` of its volume, or until the trials of one grain have all failed. At random
    places, equal spheres reach a fraction of about 0.3 with some thousand trials, and do not reach 0.38 with
    any number of trials. LIGGGHTS has this as ``fix insert/pack``. ``at_rest`` regards the insertion as
    complete after the first filling, because later room for grains cannot be foreseen.
    """

    interval: float = parameter("s", "time between two fillings", gt=0, examples=[1.0])
    tries: int = option("insertion trials for a grain", 1000, gt=0, le=MOST_TRIES)

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
