"""Discharge rates of hoppers: from a time series of the discharged mass, and from Beverloo's law."""

from __future__ import annotations

import numpy as np
from scipy.constants import g as STANDARD_GRAVITY

from tisim.errors import must

STEADY = (0.2, 0.8)
"""The flow is taken as steady while the discharged mass is between these fractions of its final value."""


def discharge_rate(time: np.ndarray, mass: np.ndarray, steady: tuple[float, float] = STEADY) -> float:
    """Return the rate (kg/s) of steady discharge: the slope of a least-squares line through the discharged
    mass (kg) at times (s) while it is between two fractions of its final value."""
    time, mass = np.asarray(time, float), np.asarray(mass, float)
    part = (mass - mass[0]) / max(mass[-1] - mass[0], np.finfo(float).tiny)
    chosen = (part >= steady[0]) & (part <= steady[1])
    must(int(chosen.sum()) >= 3, "times of steady flow", "at least 3", int(chosen.sum()))
    return float(np.polyfit(time[chosen], mass[chosen], 1)[0])


def discharge_rates(time: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return the rate (kg/s) from each time (s) to the next; shape (times - 1,)."""
    return np.asarray(np.diff(mass) / np.diff(time))


def beverloo_rate(
    outlet: float,
    diameter: float,
    bulk_density: float,
    gravity: float = STANDARD_GRAVITY,
    discharge: float = 0.58,
    empty: float = 1.4,
) -> float:
    """Return the rate (kg/s) at which grains flow through a circular outlet in a flat bottom.

        W = C rho_b sqrt(g) (D_0 - k d)^(5/2)

    outlet : its diameter D_0, m.
    diameter : diameter d of the grains, m.
    bulk_density : rho_b of the bed, kg/m^3.
    gravity : g, m/s^2.
    discharge : C, 0.55 to 0.65.
    empty : k, 1 to 2, width of the empty annulus along the rim in grain diameters.

    Source: W. A. Beverloo, H. A. Leniger, J. van de Velde, Chem. Eng. Sci. 15 (1961) 260.
    """
    free = outlet - empty * diameter
    must(free > 0, "outlet", f"wider than {empty:g} diameters of a grain", outlet)
    return float(discharge * bulk_density * np.sqrt(gravity) * free**2.5)
