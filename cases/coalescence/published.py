"""Published values of L21 for its clouds and asteroids: section 4.2, each number once."""

from typing import NamedTuple

NUMBER, SPACING, SEED_DIAMETER = 32_662, 2.0, 5.0
"""Number of grains of the cloud, spacing of its lattice and diameter of the seed particle, m; section
4.2.1.4."""
DIAMETERS = (0.5, 1.0)
"""Diameters of the grains, m; table 4.1."""
DENSITY, YOUNG, POISSON, RESTITUTION, SURFACE_ENERGY, FRICTION = 3000.0, 1e6, 0.3, 0.1, 2.86e-3, 0.4
"""Material constants of the grains, in kg/m^3, Pa, J/m^2 or as ratios; table 4.1."""
ROLLING_FRICTION, ROLLING_DAMPING, ROLLING_STIFFNESS = 0.8, 0.4, 10.0
"""mu_r, gamma_r and k_r of table 4.1, which has no units; interpreted as the parameters of ``rolling_sds``, N
s/m and N/m."""
MAGNETISATIONS = (0.0, 119.0, 1190.0)
"""Magnetisations of the grains, A/m; table 4.1."""
TEMPERATURE = 8e20
"""Initial temperature of the cloud divided by the cube of a grain's diameter, K/m^3; section 4.2.1.4."""
SPIN_MEAN, SPIN_DEVIATION = 5e-5, 1e-4
"""Mean and standard deviation of the initial spins of grains, rad/s; table 4.1. They apply to each
component."""
ROTATIONS = (500e-6, 1000e-6, 2000e-6)
"""Angular velocities of the cloud as they are printed, rad/s; section 4.2.1.4."""
DURATION = 15_000.0
"""Simulated time, s; section 4.2.2.1."""
CUTOFF = 6.0
"""Cut-off of the dipole interaction, in radii (three diameters); section 4.2.1.2."""
GASPRA = 93.0
"""The magnetisation of Gaspra, an asteroid that a spacecraft has visited, A/m; section 4.6."""


class BoundParts(NamedTuple):
    """Fractions of the grains outside the asteroid that are in clusters of two or more, and of more than
    ten."""

    some: float
    many: float


BOUND = {
    0.0: BoundParts(0.007, 0.0),
    119.0: BoundParts(0.145, 0.01),
    1190.0: BoundParts(0.89, 0.45),
}
"""Fractions by magnetisation (A/m), for grains of 50 cm at 15 000 s; section 4.2.2.1."""


class Bulk(NamedTuple):
    """The sum of the moments of the grains of an asteroid.

    moment : of the asteroid, A m^2. aligned : over the sum of the magnitudes.
    magnetisation, tight : over the volume of the convex hull, and of a hull that need not be convex, A/m.
    """

    moment: float
    aligned: float
    magnetisation: float
    tight: float


BULK = {119.0: Bulk(7.3e3, 0.04, 3.0, 3.2), 1190.0: Bulk(7.1e4, 0.032, 6.4, 8.7)}
"""By magnetisation of the grains (A/m), which are of 50 cm; section 4.2.2.4."""

AXES = {
    (0.5, 500e-6, 0.0): (9.1738, 8.8680, 8.2030),
    (0.5, 500e-6, 119.0): (9.3322, 9.0238, 8.4696),
    (0.5, 1000e-6, 0.0): (9.6852, 9.4346, 6.8965),
    (0.5, 1000e-6, 119.0): (9.7087, 9.4537, 7.4939),
    (0.5, 1000e-6, 1190.0): (17.7205, 16.8534, 12.7270),
    (0.5, 2000e-6, 0.0): (10.3581, 9.8403, 5.0588),
    (0.5, 2000e-6, 119.0): (11.3061, 10.2350, 5.1584),
    (1.0, 1000e-6, 0.0): (21.3510, 20.5915, 19.6541),
    (1.0, 1000e-6, 119.0): (21.3678, 20.7571, 20.0575),
    (1.0, 1000e-6, 1190.0): (25.9366, 25.1804, 24.1899),
}
"""Axes (m) of the bounding ellipsoid by diameter (m), angular velocity (rad/s) and magnetisation (A/m); table
4.2. They are half axes, because all grains would fill 60 % of a ball with a radius of 9.5 m (0.5) or 19 m
(1.0)."""
