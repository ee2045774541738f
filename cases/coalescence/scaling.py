"""What rules a cloud of grains and the asteroid that it becomes, in closed form (L21 section 4.5).

A cloud of fewer grains on the same lattice falls together in the same time, as that goes by its density
alone, but its gravity is weaker. It is a copy of a larger one, its radius s times as large, where all
velocities are s times as large and all stresses s^2 times: Young's modulus, what cohesion and magnetism hold
together by, the pressure in the middle. Magnetisations then are s times as large, and steps 1/s times as
long. What is not alike is how many grains lie side by side.
"""

from __future__ import annotations

import math

from scipy.constants import G
from tisim.cases.dipoles import attraction_in_line

PACKED = 0.6
"""Grains of a pile fill about this part of it."""


def sphere_mass(diameter: float, density: float) -> float:
    """Return the mass of a sphere, kg."""
    return density * math.pi / 6 * diameter**3


def mean_density(diameter: float, spacing: float, density: float) -> float:
    """Return the density of grains on a simple cubic lattice, kg/m^3."""
    return sphere_mass(diameter, density) / spacing**3


def free_fall(density: float) -> float:
    """Return the time (s) in which a ball of some density (kg/m^3) at rest falls together: sqrt(3 pi / (32 G
    rho))."""
    return math.sqrt(3 * math.pi / (32 * G * density))


def critical_spin(density: float) -> float:
    """Return the angular velocity (rad/s) at which a ball of some density (kg/m^3) has no weight at its
    equator: sqrt(4 pi G rho / 3). A ball of that density as a whole that turns faster flies apart."""
    return math.sqrt(4 * math.pi * G * density / 3)


def spin_when_packed(rotation: float, diameter: float, spacing: float) -> float:
    """Return the angular velocity (rad/s) with which a ball of grains that turns as a whole on its lattice
    turns once it is a pile, as its angular momentum stays and it remains a ball."""
    shrinks = math.pi / 6 * diameter**3 / PACKED / spacing**3
    return rotation * shrinks ** (-2 / 3)


def attraction(diameter: float, magnetisation: float) -> float:
    """Return the force (N) of two magnets in contact, one behind the other."""
    return attraction_in_line(magnetisation * math.pi / 6 * diameter**3, diameter)


def surface_weight(diameter: float, density: float, acceleration: float) -> float:
    """Return the weight of a grain, N (L21 Eq. 4.13)."""
    return sphere_mass(diameter, density) * acceleration


def mutual_gravity(diameter: float, density: float) -> float:
    """Return the gravity of two grains in contact: G (2/3 pi rho R^2)^2, N. L21 Eq. (4.14) has 1/3."""
    return G * (2 / 3 * math.pi * density * (diameter / 2) ** 2) ** 2


def surface_cohesion(diameter: float, cleanliness: float) -> float:
    """Return 0.036 S^2 R, N (L21 Eq. 4.15); S is 1 of clean surfaces."""
    return 3.6e-2 * cleanliness**2 * diameter / 2


def dmt_cohesion(diameter: float, surface_energy: float) -> float:
    """Return the cohesion of two grains, 4 pi gamma R*, N (L21 Eq. 4.5)."""
    return math.pi * surface_energy * diameter
