"""The magnetisation of a soft cylinder in a uniform field, limited by self-shielding and saturation.

Plain NumPy to compute input for a scene: ``Cylinder(..., magnetisation=magnetisation(...))``.
"""

from __future__ import annotations

import numpy as np
from scipy.constants import mu_0

from tisim.components.component import Vector
from tisim.errors import must
from tisim.sources.magnetic import stoner_wohlfarth
from tisim.sources.magnetic.stoner_wohlfarth import demagnetising_factor


def magnetisation(
    axis: Vector, radius: float, length: float, saturation: float, flux_density: Vector
) -> Vector:
    """Return M (A/m) of a body without hysteresis and with infinite permeability, in a uniform field B_0 (T).

    It minimises shape and Zeeman energy, mu_0/2 M.N M - M.B_0 per volume, among all M with a magnitude of at
    most ``saturation``. The field of the body then cancels the applied one inside, N M = B_0/mu_0 along each
    axis, until the body is saturated. Beyond saturation M turns towards the field, as in a body that is
    always saturated (stoner_wohlfarth.py). N is the mean over the volume. Long bodies saturate in weaker
    fields along their axis than across it, because N across is near 1/2.

    Source: R. M. Bozorth, D. M. Chapin, J. Appl. Phys. 13 (1942) 320.

    InputError is raised for an axis of length 0, or a cylinder or saturation that is not above 0.
    """
    size = float(np.linalg.norm(axis))
    must(0 < size < np.inf, "axis of a cylinder", "a direction", axis)
    must(saturation > 0, "saturation magnetisation", "greater than 0", saturation)
    n = demagnetising_factor(radius, length)
    direction, field = np.asarray(axis, float) / size, np.asarray(flux_density, float)
    along = (field @ direction) * direction
    m = (along / n + (field - along) / (0.5 * (1 - n))) / mu_0
    if np.linalg.norm(m) > saturation:
        return stoner_wohlfarth.magnetisation(axis, radius, length, saturation, flux_density)
    return float(m[0]), float(m[1]), float(m[2])
