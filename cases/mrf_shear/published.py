"""What L21 has in chapter 2: the numbers of its tables and of the text beside them.

The measurements are those of C. Trendler and H. Bose, J. Magn. Magn. Mater. 293 (2005) 741, as L21 gives
them. L21 does not print density and permeability of the grains; its +77.78 % and -20.99 % for pairs (section
2.2.3) are those of a permeability that is large beside 1.
"""

from __future__ import annotations

MICRO = 1e-6
"""A micrometre, m."""

# Table 2.1: particle properties.
YOUNG = 1e9
"""Young's modulus, Pa; L21 says that it is about 1 % of that of iron."""
POISSON, RESTITUTION = 0.278, 0.1
"""Poisson's ratio and coefficient of restitution."""
FRICTION, ROLLING_FRICTION, ROLLING_DAMPING = 0.1, 0.1, 0.1
"""Coefficients of sliding and of rolling friction, and the part of critical damping that holds back
rolling."""
COHESION = 60e3
"""Cohesion energy density k_c, J/m^3."""

# Section 2.3: the cell and the fluid.
OIL_VISCOSITY = 10e-3
"""Dynamic viscosity of the oil, Pa s."""
FRACTION = 0.3
"""Volume fraction of the grains."""
FLUX = 0.6
"""Magnetic flux density along z, T."""
CELL_SIDE, RAFT_DEPTH = 250 * MICRO, 15 * MICRO
"""Side of the cubic cell, and how much of its bottom and of its top is frozen, m."""
STEP = 2e-10
"""A step takes so long, s."""
NEIGHBOUR_GAP = 8 * MICRO
"""Grains magnetise each other up to this gap between surfaces, m (section 2.4.3)."""
MEAN_LARGE = 6.7 * MICRO
"""Mean diameter of the large grains, m."""
CHAINS_FORM = 1e5 * STEP
"""Chains have formed in about so long, s (section 2.4.1)."""
WALL_SPEEDS = (0.128, 0.064, 0.032, 0.011, 0.008, 0.004, 0.002, 0.001)
"""Speeds of each raft, one after the other, m/s."""
SHEAR_RATES = tuple(2 * speed / (CELL_SIDE - 2 * RAFT_DEPTH) for speed in WALL_SPEEDS)
"""Shear rates between the rafts, 1/s: L21 names 590, 36.4 and 9 among them."""

# Table 2.4 and section 2.4.2: yield stresses at 0.6 T, Pa.
MEASURED_YIELD = {"00:100": 44.9e3, "33:67": 50.8e3}
SIMULATED_YIELD = {"00:100": 44.1e3, "33:67": 56.3e3}
"""These are of number densities, L21's own; of volume densities it has 49.6 kPa for 00:100."""
SEED_SPREAD = 0.029
"""Standard deviation of the yield stress from seed to seed, over its mean."""
