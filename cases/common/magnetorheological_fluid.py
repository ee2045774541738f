"""The magnetorheological fluids of L21: iron grains in oil, and their viscosity without a field.

A mixture of grains is a tuple of classes of equal grains, for a cloud or an insertion.

The viscosity without a field is not simulated. The oil of the simulations is a prescribed flow, which does
not flow around grains, lubricate them or transmit stress. Without a field, grains therefore move with their
layer, and the force on the walls is almost zero for any number of grains. The law of Krieger and Dougherty is
used instead. Sizes and proportions of the grains enter through their maximum packing fraction, by the packing
model of de Larrard.
"""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from tisim import Material
from tisim.effects import (
    CARBONYL_IRON,
    Granular,
    HertzMaterial,
    MindlinForce,
    RestitutionDamping,
    RollingEPSD,
)
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
TABLE_2_1 = {"poisson": 0.278, "restitution": 0.1, "friction": 0.1, "rolling_friction": 0.1}
"""Poisson's ratio, coefficient of restitution, and coefficients of sliding and of rolling friction of the
grains (L21 table 2.1)."""
ROLLING_DAMPING_RATIO = 0.1
"""The rolling damping of the grains, as a fraction of critical damping (L21 table 2.1)."""
MICRO = 1e-6
"""A micrometre, m."""
RANDOM_PACKING = 0.64
"""Packing fraction of equal spheres in a random close packing."""
INTRINSIC = 2.5
"""Intrinsic viscosity of hard spheres, by Einstein."""
SWEPT = {"effects.mutual_induced_moment.largest_change": 0.1}
"""In a search, sweeps of the moments in a step continue only if moments change by more than a tenth of the
largest. This halves the time and has no effect on the quantities that `tisim cost` shows over eight
starts."""


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
        GrainClass(sizes=EqualSizes(radius=diameter * MICRO / 2), density=density, share=share * mass / whole)
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


def equal(radius: float, share: float) -> tuple[GrainClass, ...]:
    """Return grains of one radius (m) that have a share of a mixture; none for a share of 0."""
    return classes(((2 * radius / MICRO, 1.0),), "mass", share) if share > 0 else ()


def number_of(grains: Sequence[GrainClass], fraction: float, volume: float) -> int:
    """Return the number of grains that fill a fraction of a volume (m^3)."""
    # The number of a class is per kg of its share.
    filled = sum(one.share / one.density for one in grains)
    return round(fraction * volume * sum(one.number() for one in grains) / filled)


def smallest(grains: Sequence[GrainClass]) -> float:
    """Return the radius of the smallest possible grain, m."""
    return float(min(one.sizes.nodes()[0].min() for one in grains))


def iron(young: float, cohesion: float | None = None, **others: float) -> Material:
    """Return the material of grains of a Young's modulus (Pa), with the other properties of TABLE_2_1.

    cohesion : energy density, J/m^3; None for a law without cohesion. others : properties that differ.
    """
    return Material(young=young, cohesion_energy_density=cohesion, **{**TABLE_2_1, **others})


def contact_law(**cohesion: Any) -> Granular:
    """Return the contact law of L21 section 2.2.1; cohesion : its law of cohesion, none by default."""
    return Granular(
        normal=HertzMaterial(),
        damping=RestitutionDamping(),
        tangential=MindlinForce(),
        rolling=RollingEPSD(damping_ratio=ROLLING_DAMPING_RATIO),
        **cohesion,
    )


def closest_packing(diameters: Sequence[float], parts: Sequence[float]) -> float:
    """Return the maximum packing fraction of a mixture of spheres.

    diameters : in any unit. parts : share of each in the volume.

        phi_m = min over i of  beta / (1 - sum over larger j of (1 - beta + b beta (1 - 1/beta)) y_j
                                         - sum over smaller j of (1 - a) y_j)
        a = sqrt(1 - (1 - d_j/d_i)^1.02),    b = 1 - (1 - d_i/d_j)^1.5

    beta is the packing fraction of equal spheres, y_j the share of the volume. a describes how small grains
    push large ones apart, b how large grains act as walls for small ones. Grains that are smaller than the
    holes fill them.

    Source: F. de Larrard, Concrete Mixture Proportioning (1999), section 1.1.
    """
    d, y, beta = np.asarray(diameters, float), np.asarray(parts, float) / np.sum(parts), RANDOM_PACKING
    fractions = []
    for size in d[y > 0]:
        larger, smaller = d > size, d < size
        wall = 1 - (1 - size / d[larger]) ** 1.5
        loosening = np.sqrt(1 - (1 - d[smaller] / size) ** 1.02)
        kept = ((1 - beta + wall * beta * (1 - 1 / beta)) * y[larger]).sum()
        kept += ((1 - loosening) * y[smaller]).sum()
        fractions.append(beta / (1 - kept))
    return float(min(fractions))


def relative_viscosity(fraction: float, closest: float) -> float:
    """Return the ratio of viscosities of a suspension and its fluid; infinite at closest packing and
    above.

        eta_r = (1 - phi / phi_m)^(-2.5 phi_m)

    Source: I. M. Krieger and T. J. Dougherty, Trans. Soc. Rheol. 3 (1959) 137.
    """
    if fraction >= closest:
        return float("inf")
    return float((1 - fraction / closest) ** (-INTRINSIC * closest))
