"""What a pressure drives through a valve without a field, by laws for dense suspensions.

The simulation does not tell it: its oil is a given flow, which neither grains nor walls change. So it is that
of Hagen and Poiseuille along a duct of slowly changing width, with the viscosity of Krieger and Dougherty.
The size of grains does not count in it: that is what jams are about.
"""

from __future__ import annotations

import numpy as np
from tisim.cases.mrf_shear.off_state import RANDOM_PACKING, relative_viscosity
from tisim.cases.valve import published
from tisim.cases.valve.duct import Duct


def resistance(duct: Duct) -> float:
    """Return the hydraulic resistance of a duct over the viscosity, 1/m^3: 8/pi times the integral of
    1/r^4, which from r_1 to r_2 along a cone of the length l is l (r_1^2 + r_1 r_2 + r_2^2) / (3 r_1^3
    r_2^3)."""
    heights, radii = duct.profile()
    a, b = radii[:-1], radii[1:]
    parts = np.diff(heights) * (a * a + a * b + b * b) / (3 * a**3 * b**3)
    return float(8 / np.pi * parts.sum())


def suspension_viscosity(fraction: float) -> float:
    """Return the viscosity without field of oil with a volume fraction of equal grains, Pa s."""
    return published.OIL_VISCOSITY * relative_viscosity(fraction, RANDOM_PACKING)


def open_flow(duct: Duct, pressure: float, fraction: float) -> float:
    """Return the volume flow rate without field, m^3/s, that a pressure (Pa) drives through a duct."""
    return pressure / (suspension_viscosity(fraction) * resistance(duct))
