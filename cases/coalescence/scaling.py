"""Scaling of a cloud of grains and of the asteroid that it becomes, in closed form (L21 section 4.5).

The collapse time of a cloud depends only on its density, so a cloud of fewer grains on the same lattice
collapses in the same time, but with weaker gravity. A cloud whose radius is s times as large is a scaled copy
if all velocities are multiplied by s and all stresses by s^2: Young's modulus, the stresses of cohesion and
magnetism, and the central pressure. Magnetisations are then multiplied by s, and steps by 1/s. Only the
number of grains across the cloud is not preserved.
"""

from __future__ import annotations

import math

from scipy.constants import G

from tisim.cases.dipoles import attraction_in_line

PACKED = 0.6
"""Packing fraction of a pile, approximately."""


def sphere_mass(diameter: float, density: float) -> float:
    """Return the mass of a sphere, kg."""
    return density * math.pi / 6 * diameter**3


def mean_density(diameter: float, spacing: float, density: float) -> float:
    """Return the density of grains on a simple cubic lattice, kg/m^3."""
    return sphere_mass(diameter, density) / spacing**3


def free_fall(density: float) -> float:
    """Return the free-fall time (s) of a ball at rest of some density (kg/m^3): sqrt(3 pi / (32 G rho))."""
    return math.sqrt(3 * math.pi / (32 * G * density))


def critical_spin(density: float) -> float:
    """Return the angular velocity (rad/s) at which a ball of some density (kg/m^3) has no weight at its
    equator.

    It is sqrt(4 pi G rho / 3), with rho the mean density of the ball. A ball that turns faster flies apart.
    """
    return math.sqrt(4 * math.pi * G * density / 3)


def spin_when_packed(rotation: float, diameter: float, spacing: float) -> float:
    """Return the angular velocity (rad/s) of the pile that a rotating ball of grains on a lattice becomes.

    The pile is assumed to be a ball with the same angular momentum. rotation : of the lattice, rad/s.
    """
    shrinks = math.pi / 6 * diameter**3 / PACKED / spacing**3
    return rotation * shrinks ** (-2 / 3)


def attraction(diameter: float, magnetisation: float) -> float:
    """Return the attraction (N) of two magnets in contact, one behind the other."""
    return attraction_in_line(magnetisation * math.pi / 6 * diameter**3, diameter)


def surface_weight(diameter: float, density: float, acceleration: float) -> float:
    """Return the weight of a grain, N (L21 Eq. 4.13)."""
    return sphere_mass(diameter, density) * acceleration


def mutual_gravity(diameter: float, density: float) -> float:
    """Return the gravitational attraction of two grains in contact: G (2/3 pi rho R^2)^2, N. L21 Eq. (4.14)
    has 1/3."""
    return G * (2 / 3 * math.pi * density * (diameter / 2) ** 2) ** 2


def surface_cohesion(diameter: float, cleanliness: float) -> float:
    """Return the cohesion 0.036 S^2 R, N (L21 Eq. 4.15); S is 1 for clean surfaces."""
    return 3.6e-2 * cleanliness**2 * diameter / 2


def dmt_cohesion(diameter: float, surface_energy: float) -> float:
    """Return the cohesion of two grains, 4 pi gamma R*, N (L21 Eq. 4.5)."""
    return math.pi * surface_energy * diameter
