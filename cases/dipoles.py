"""The force of two magnetic dipoles in line, which several cases use for the attraction of grains."""

from __future__ import annotations

import math

from scipy.constants import mu_0


def attraction_in_line(moment: float, distance: float) -> float:
    """Return the attraction (N) of two equal dipoles (A m^2) in line at a distance (m): 3 mu_0 m^2 / (2 pi
    d^4)."""
    return 3 * mu_0 * moment**2 / (2 * math.pi * distance**4)
