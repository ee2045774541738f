"""The flow that a pressure drives through a valve without a field, by laws for dense suspensions.

The simulation cannot give it, because its oil is a prescribed flow that neither grains nor walls change. The
flow is computed by the law of Hagen and Poiseuille for a duct of slowly changing width, with the viscosity of
Krieger and Dougherty. It does not depend on the size of grains; only jams do.
"""

from __future__ import annotations

import numpy as np

from tisim.cases.mrf_shear.off_state import RANDOM_PACKING, relative_viscosity
from tisim.cases.valve import published
from tisim.cases.valve.duct import Duct


def resistance(duct: Duct) -> float:
    """Return the hydraulic resistance of a duct divided by the viscosity, 1/m^3.

    It is 8/pi times the integral of 1/r^4, which is l (r_1^2 + r_1 r_2 + r_2^2) / (3 r_1^3 r_2^3) along a
    cone of the length l from r_1 to r_2.
    """
    heights, radii = duct.profile()
    a, b = radii[:-1], radii[1:]
    parts = np.diff(heights) * (a * a + a * b + b * b) / (3 * a**3 * b**3)
    return float(8 / np.pi * parts.sum())


def suspension_viscosity(fraction: float) -> float:
    """Return the viscosity without field of oil with a volume fraction of equal grains, Pa s."""
    return published.OIL_VISCOSITY * relative_viscosity(fraction, RANDOM_PACKING)


def open_flow(duct: Duct, pressure: float, fraction: float) -> float:
    """Return the volume flow rate, m^3/s, that a pressure (Pa) drives through a duct without a field."""
    return pressure / (suspension_viscosity(fraction) * resistance(duct))
