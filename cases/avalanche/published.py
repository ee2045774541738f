"""What L21 has of avalanches: table 4.5."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Slope:
    """A slope has an angle of repose, degrees, and a heap of a volume, m^3."""

    angle: float
    volume: float


SLOPES = {
    5e-3: (Slope(37.2209, 1.1602), Slope(50.4837, 1.2659)),
    1e-2: (Slope(32.4847, 1.4859), Slope(34.4926, 1.6097)),
    5e-2: (Slope(31.2953, 37.6239), Slope(31.4193, 38.1069)),
}
"""By the diameter of the grains, m: without a field and with one. The volumes are larger than those of cells
that so many grains would fill to four tenths, and than the cells of 1.2 m^3: what counts is their ratio."""


def larger(diameter: float) -> float:
    """Return the volume of a magnetised heap over that of one without a field."""
    without, magnetised = SLOPES[diameter]
    return magnetised.volume / without.volume
