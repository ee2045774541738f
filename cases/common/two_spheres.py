"""Two spheres in closed form: the elastic impact by Hertz, and the attraction of two dipoles.

E* is 1 / ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2). R* and m* are 1/(1/R_1 + 1/R_2) and 1/(1/m_1 + 1/m_2); at a
plane they are R and m of the sphere. Unless a type says float, arguments may be arrays that broadcast; SI
units.
"""

import math

import numpy as np
from scipy.constants import mu_0
from scipy.special import beta

Numbers = np.ndarray | float

HERTZ_DURATION = float(0.8 * beta(0.4, 0.5))
"""The duration of an elastic impact times its speed divided by its depth: 2.943275."""


def reduced(a: float, b: float = np.inf) -> float:
    """Return 1 / (1/a + 1/b), such as R* and m*; a if b is infinite, as for a plane."""
    return 1.0 / (1.0 / a + 1.0 / b)


def sphere_mass(diameter: float, density: float) -> float:
    """Return the mass of a sphere, kg."""
    return density * math.pi / 6 * diameter**3


def hertz_force(overlap: Numbers, radius: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the force 4/3 E* sqrt(R*) delta^(3/2) (N) at an overlap (m); 0 without overlap."""
    return np.asarray(4 / 3 * modulus * np.sqrt(radius) * np.maximum(overlap, 0.0) ** 1.5)


def hertz_overlap(force: Numbers, radius: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the overlap (m) at which the repulsion is a given force (N)."""
    return np.asarray((3 * np.asarray(force) / (4 * modulus * np.sqrt(radius))) ** (2 / 3))


def hertz_depth(speed: Numbers, radius: Numbers, mass: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the largest overlap (m) of an elastic impact of R* and m* at a relative speed (m/s).

    All of m* v^2 / 2 is then stored in the contact: delta = (15 m* v^2 / (16 E* sqrt(R*)))^(2/5).
    """
    return np.asarray((15 * mass * np.asarray(speed) ** 2 / (16 * modulus * np.sqrt(radius))) ** 0.4)


def hertz_duration(speed: Numbers, radius: Numbers, mass: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the duration (s) of an elastic impact of R* and m* at a relative speed (m/s)."""
    return HERTZ_DURATION * hertz_depth(speed, radius, mass, modulus) / speed


def attraction_in_line(moment: float, distance: float) -> float:
    """Return the attraction (N) of two equal dipoles (A m^2) in line at a distance (m): 3 mu_0 m^2 / (2 pi
    d^4)."""
    return 3 * mu_0 * moment**2 / (2 * math.pi * distance**4)


def attraction(diameter: float, magnetisation: float) -> float:
    """Return the attraction (N) of two magnets in contact, one behind the other."""
    return attraction_in_line(magnetisation * math.pi / 6 * diameter**3, diameter)
