"""Published values of L21 for its valve: the numbers of section 3.4.4.

L21 does not state the inner diameter of the duct, any length along it, or the taper of the constriction (its
figure 3.7 has no scale). It does not state Poisson's ratio, restitution and rolling friction; the values of
its table 2.1 are used, because it says that the module is the same. It also does not state the cohesion,
which is left out, or the cut-off of the magnetic forces ("close neighbors").
"""

from tisim.cases.common.magnetorheological_fluid import MICRO

LARGEST, FINE_LARGEST = 44 * MICRO, 10 * MICRO
"""Diameters of the largest grains of the coarse and of the fine mixture, m."""
CONSTRICTIONS = {20: 0.88e-3, 30: 1.32e-3, 40: 1.76e-3}
"""Diameters of the constrictions, m, by their width in diameters of the largest grains."""
FRACTION = 0.345
"""Volume fraction of the grains."""
YOUNG = 1e9
"""Young's modulus, Pa, in place of the 200 GPa of iron."""
FRICTION = 0.4
"""Coefficient of friction."""
OIL_VISCOSITY = 0.16
"""Dynamic viscosity of the oil, Pa s."""
OIL_SPEED = 0.273
"""Speed of the oil within the diameter of the constriction, along the duct, m/s."""
PRESSURE = 100e3
"""The drag on an arrested flow corresponds to about this pressure, Pa."""
STEP, FINE_STEP = 20e-9, 5e-9
"""Steps for coarse and for fine grains, s."""
UNMAGNETISED = 1e-3
"""Duration of the flow without a field, s."""
FLUX = 0.23
"""Flux density across the valve, T."""
