"""The mixtures of iron grains of L21, as classes of equal grains for a cloud or an insertion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from tisim.effects import CARBONYL_IRON
from tisim.packing import EqualSizes, GrainClass

Parts = Sequence[tuple[float, float]]
"""Diameters, um, and the share of grains of each."""

SMALL_GRAINS: Parts = (
    (0.67, 0.0033), (0.78, 0.0160), (0.91, 0.0367), (1.05, 0.0609), (1.25, 0.0863), (1.43, 0.1092),
    (1.67, 0.1242), (1.96, 0.1326), (2.25, 0.1329), (2.63, 0.1097), (3.03, 0.0821), (3.55, 0.0540),
    (4.16, 0.0316), (4.97, 0.0146), (5.71, 0.0057), (7.02, 2.230e-4),
)  # fmt: skip
"""Grains with a median of 1.8 um, digitised from Trendler and Boese, who do not say whether the shares are by
number or by volume (L21 table 2.2a)."""
LARGE_GRAINS: Parts = (
    (1.46, 1e-4), (1.69, 6.155e-4), (1.98, 0.0019), (2.29, 0.0047), (2.65, 0.0117), (3.07, 0.0226),
    (3.57, 0.0403), (4.11, 0.0646), (4.89, 0.0925), (5.69, 0.1167), (6.55, 0.1327), (7.66, 0.1403),
    (8.84, 0.1236), (10.42, 0.0985), (11.87, 0.0699), (13.91, 0.0446), (16.63, 0.0243), (19.48, 0.0100),
    (24.44, 5.593e-4),
)  # fmt: skip
"""Grains with a median of 6.7 um, in the same way (L21 table 2.2b)."""
VALVE_GRAINS: Parts = ((44.0, 44.0), (38.9, 35.0), (33.8, 24.2), (28.7, 13.2), (23.6, 5.6))
"""Grains that jam a valve, as shares of the mass; they add up to 122 and are normalised (L21 3.4.4)."""
FINE_VALVE_GRAINS: Parts = ((10.0, 44.0), (9.49, 35.0), (8.98, 24.2), (8.47, 13.2), (7.96, 5.6))
"""Grains that do not jam a valve, as shares of the mass, normalised in the same way (L21 3.4.4)."""


def classes(
    parts: Parts,
    by: Literal["number", "mass"],
    share: float = 1.0,
    density: float = CARBONYL_IRON.density,
) -> tuple[GrainClass, ...]:
    """Return classes of equal grains that together have ``share`` of the mass of a mixture.

    by : whether the parts are by number or by mass, which is proportional to volume. density : kg/m^3.
    """
    masses = [part * (diameter**3 if by == "number" else 1.0) for diameter, part in parts]
    whole = sum(masses)
    return tuple(
        GrainClass(sizes=EqualSizes(radius=diameter * 1e-6 / 2), density=density, share=share * mass / whole)
        for (diameter, _), mass in zip(parts, masses, strict=True)
    )


def magnetorheological(small: float, by: Literal["number", "mass"] = "number") -> tuple[GrainClass, ...]:
    """Return the classes of a fluid of small and large grains.

    small : mass fraction of the small grains, 0 and 0.33 in L21 (00:100 and 33:67).
    by : whether the size distributions are by number or by mass.
    """
    few = classes(SMALL_GRAINS, by, small) if small > 0 else ()
    many = classes(LARGE_GRAINS, by, 1.0 - small) if small < 1 else ()
    return (*few, *many)
