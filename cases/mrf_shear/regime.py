"""Governing numbers of a magnetorheological fluid in closed form: they show that faster shear than L21's is
still quasi-static."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.constants import mu_0

from tisim.cases.coalescence.scaling import attraction, sphere_mass
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.grains import DENSITY, LARGE_RADIUS
from tisim.cases.mrf_shear.scene import RATES, SUSCEPTIBILITY
from tisim.cases.statistics import Shown
from tisim.effects import CARBONYL_IRON

DIAMETER = 2 * LARGE_RADIUS
"""Diameter of the large grains, m."""


def magnetisation(flux: float) -> float:
    """Return the magnetisation (A/m) of a single grain in a field (T): 3 chi / (3 + chi) B / mu_0."""
    return 3 * SUSCEPTIBILITY / (3 + SUSCEPTIBILITY) * flux / mu_0


def mason_number(rate: float, flux: float) -> float:
    """Return the Mason number, Mn = 8 eta rate mu_0 / B^2: the ratio of drag in a shear flow to magnetic
    forces.

    Other authors define it with other factors.
    """
    return 8 * published.OIL_VISCOSITY * rate * mu_0 / flux**2


def stokes_time() -> float:
    """Return the time in which oil stops a grain, m / (6 pi eta R) = 2 rho R^2 / (9 eta), s."""
    return 2 * DENSITY * LARGE_RADIUS**2 / (9 * published.OIL_VISCOSITY)


def approach_time(flux: float) -> float:
    """Return the time (s) in which the attraction of two grains in line moves one of them by its radius: (2 R
    m / F)^(1/2).

    The attraction is that at contact.
    """
    force = attraction(DIAMETER, magnetisation(flux))
    return float(np.sqrt(2 * LARGE_RADIUS * sphere_mass(DIAMETER, DENSITY) / force))


def regime() -> Iterator[Shown]:
    """Yield the governing numbers of grains at 0.6 T, with the moments of the external field alone."""
    flux = published.FLUX
    for rate in (RATES[0], RATES[-1]):
        yield Shown(f"Mason number at {rate:g} 1/s", mason_number(rate, flux))
    force = attraction(DIAMETER, magnetisation(flux))
    yield Shown("attraction of two touching grains in line, uN", 1e6 * force)
    yield Shown("time in which it moves a grain by a radius, us", 1e6 * approach_time(flux))
    yield Shown("time in which oil stops a grain, us", 1e6 * stokes_time())
    yield Shown(f"duration of a strain of 1 at {RATES[-1]:g} 1/s, us", 1e6 / RATES[-1])
    saturated = f"iron saturates at {1e-6 * CARBONYL_IRON.saturation:.2f}"
    yield Shown("magnetisation of a single grain, MA/m", 1e-6 * magnetisation(flux), saturated)
