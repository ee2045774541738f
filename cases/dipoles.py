"""The force of two magnetic dipoles in line, which grains of several cases attract each other with."""

from __future__ import annotations

import math

from scipy.constants import mu_0


def attraction_in_line(moment: float, distance: float) -> float:
    """Return the force (N) with which two equal dipoles (A m^2) at a distance (m), one behind the other,
    attract each other: 3 mu_0 m^2 / (2 pi d^4)."""
    return 3 * mu_0 * moment**2 / (2 * math.pi * distance**4)
