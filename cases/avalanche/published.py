"""Published results of L21 for avalanches: table 4.5."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Slope:
    """The slope of a heap: angle of repose, degrees, and volume, m^3."""

    angle: float
    volume: float


SLOPES = {
    5e-3: (Slope(37.2209, 1.1602), Slope(50.4837, 1.2659)),
    1e-2: (Slope(32.4847, 1.4859), Slope(34.4926, 1.6097)),
    5e-2: (Slope(31.2953, 37.6239), Slope(31.4193, 38.1069)),
}
"""Slopes without a field and with one, by grain diameter, m. Only the ratio of the volumes is used: they are
larger than the volume of 1.2 m^3 of the cells, and larger than the volume of these numbers of grains at a
packing fraction of four tenths."""


def larger(diameter: float) -> float:
    """Return the ratio of the volumes of a heap with and without a field."""
    without, magnetised = SLOPES[diameter]
    return magnetised.volume / without.volume
