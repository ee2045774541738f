"""The magnetised fibre of B16, as a cylinder, and published values of the colloids that it attracts.

B16 is R. J. Baars, thesis, Utrecht University (2016), chapter 6. The fibre is a steel cylinder in a field
along x. It is saturated. Its magnetisation has the direction given by the model of Stoner and Wohlfarth, or
the direction of the field.
"""

from typing import Literal

import numpy as np

from tisim.sources import Cylinder
from tisim.sources.magnetic.stoner_wohlfarth import magnetisation

FIBRE_DIAMETER, SATURATION_MAGNETISATION, APPLIED_FLUX = 600e-6, 985e3, 1.0
"""The cylinder's diameter, m, and magnetisation, A/m; the flux density along x, T (B16 section 6.3)."""
WATER_TEMPERATURE, WATER_VISCOSITY = 298.0, 1e-3
"""The water's temperature, K, and viscosity, Pa s (B16 section 6.3)."""
SATURATION_MOMENTS = {
    25: 0.016e-16,
    50: 0.344e-16,
    75: 0.870e-16,
    100: 0.662e-16,
    125: 5.151e-16,
    212: 19.35e-16,
}
"""The saturation moment of a particle, A m^2, by its hydrodynamic radius in nm (B16 table 6.1)."""
MICRO = 1e-6
"""A micrometre, m."""

Magnetised = Literal["minimum", "fixed"]


def fibre(angle: float, aspect: float, magnetised: Magnetised = "minimum") -> Cylinder:
    """Return the fibre at the origin, at an angle (degrees) to the field.

    aspect : its length over its diameter.
    magnetised : in the direction of least energy (Stoner and Wohlfarth), as in B16 except section 6.4.1; or
        "fixed" along the field, at ``angle`` to the axis, as in section 6.4.1.
    """
    along = float(np.cos(np.radians(angle))), 0.0, float(np.sin(np.radians(angle)))
    radius, length = FIBRE_DIAMETER / 2, aspect * FIBRE_DIAMETER
    m = (
        (SATURATION_MAGNETISATION, 0.0, 0.0)
        if magnetised == "fixed"
        else magnetisation(along, radius, length, SATURATION_MAGNETISATION, (APPLIED_FLUX, 0.0, 0.0))
    )
    return Cylinder(axis=along, radius=radius, length=length, magnetisation=m)
