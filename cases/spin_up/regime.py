"""Governing numbers of the piles of the case spin_up, in closed form: scale, times, and overlaps of
grains."""

from __future__ import annotations

from collections.abc import Iterator

from tisim.cases.coalescence.published import DENSITY, DIAMETERS, MAGNETISATIONS
from tisim.cases.coalescence.regime import impact_depth, magnetic_depth
from tisim.cases.coalescence.scaling import free_fall, mean_density
from tisim.cases.coalescence.scene import scale_of, step
from tisim.cases.spin_up.scene import DEFAULT, NUMBERS
from tisim.cases.statistics import Shown


def regime() -> Iterator[Shown]:
    """Yield the numbers of the copy of the default size."""
    d, softened = DIAMETERS[1], DEFAULT["softened"]
    scale = scale_of(DEFAULT["number"], NUMBERS[d])
    yield Shown("scale of the copy", scale)
    yield Shown("free-fall time, s", free_fall(mean_density(d, DEFAULT["spacing"], DENSITY)))
    yield Shown("step, s", step(d, scale, softened))
    yield Shown("overlap of an impact over a radius", impact_depth(d, scale, softened))
    depth = magnetic_depth(d, scale, MAGNETISATIONS[-1], softened)
    yield Shown("overlap of two grains in line over a radius, 1190 A/m", depth)
