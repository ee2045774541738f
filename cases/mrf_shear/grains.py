"""The grains of a magnetorheological fluid: mixtures of two sizes, and the number of grains for a volume
fraction."""

from __future__ import annotations

from collections.abc import Sequence

from tisim import GrainClass
from tisim.cases.mixtures import classes
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.published import MICRO
from tisim.effects import CARBONYL_IRON

DENSITY = CARBONYL_IRON.density
"""Density of the grains, kg/m^3."""
LARGE_RADIUS, SMALL_RADIUS = published.MEAN_LARGE / 2, published.MEAN_LARGE / 4
"""The radius of the large grains, and of the small grains of a mixture at sizes for a laptop, m. The small
ones are half as large; L21's are a quarter, which would be 25 small grains for each large one in a mixture of
33:67."""


def equal(radius: float, share: float) -> tuple[GrainClass, ...]:
    """Return grains of one radius (m) that have a share of a mixture; none for a share of 0."""
    return classes(((2 * radius / MICRO, 1.0),), "mass", share) if share > 0 else ()


def mixture(share: float) -> tuple[GrainClass, ...]:
    """Return a mixture of large and small grains of one size each; share : of the small grains, 0 to 1."""
    return (*equal(LARGE_RADIUS, 1 - share), *equal(SMALL_RADIUS, share))


MONODISPERSE = mixture(0.0)
"""Grains of one size, the mean of L21's large grains."""


def number_of(grains: Sequence[GrainClass], fraction: float, volume: float) -> int:
    """Return the number of grains that fill a fraction of a volume (m^3)."""
    # The number of a class is per kg of its share.
    filled = sum(one.share / one.density for one in grains)
    return round(fraction * volume * sum(one.number() for one in grains) / filled)


def smallest(grains: Sequence[GrainClass]) -> float:
    """Return the radius of the smallest possible grain, m."""
    return float(min(one.sizes.nodes()[0].min() for one in grains))
