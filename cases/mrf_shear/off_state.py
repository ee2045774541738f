"""The viscosity of the fluid without a field, by a law for dense suspensions.

The cell itself cannot give it. Its oil is a prescribed flow, which does not flow around grains, lubricate
them or transmit stress. Without a field, grains therefore move with their layer, and the force on the rafts
is almost zero for any number of grains. The law of Krieger and Dougherty is used instead. Sizes and
proportions of the grains enter through their maximum packing fraction, by the packing model of de Larrard.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tisim.cases.mrf_shear import published

RANDOM_PACKING = 0.64
"""Packing fraction of equal spheres in a random close packing."""
INTRINSIC = 2.5
"""Intrinsic viscosity of hard spheres, by Einstein."""


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


def off_state_viscosity(fraction: float, diameters: Sequence[float], parts: Sequence[float]) -> float:
    """Return the viscosity of the fluid without a field, Pa s."""
    return published.OIL_VISCOSITY * relative_viscosity(fraction, closest_packing(diameters, parts))
