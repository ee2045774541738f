"""Measures of a rubble pile: clusters of its grains, the asteroid that they form, and conserved quantities.

Free-fall times and critical spins of clouds and piles are in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.constants import G

from tisim import analysis
from tisim.cases.common.two_spheres import sphere_mass
from tisim.scene.initial_state import Arrays

GAP = 0.01
"""Largest gap between the surfaces of bound grains, in units of the smallest diameter."""


def clusters_of(state: Arrays) -> np.ndarray:
    """Return the cluster of each grain, as connected by contacts; shape (n,)."""
    radius = state["radius"]
    gap = GAP * 2 * float(radius.min())
    return analysis.labels(len(radius), analysis.contacts(state["position"], radius, gap))


def body(cluster: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return a mask of the grains in the heaviest cluster, the asteroid; shape (n,)."""
    return np.asarray(cluster == np.bincount(cluster, mass).argmax())


def part(state: Arrays, some: np.ndarray) -> Arrays:
    """Return the state of some of the grains."""
    return {name: values[some] for name, values in state.items()}


@dataclass(frozen=True)
class Asteroid:
    """The grains of an asteroid, and its bounding ellipsoid."""

    grains: Arrays
    ellipsoid: analysis.Ellipsoid

    @classmethod
    def of(cls, state: Arrays) -> Asteroid:
        """Return the asteroid in a state; it must have at least two grains."""
        grains = part(state, body(clusters_of(state), state["mass"]))
        return cls(grains, analysis.bounding_ellipsoid(grains["position"], grains["radius"]))

    @property
    def number(self) -> int:
        """Return the number of its grains."""
        return len(self.grains["mass"])

    @property
    def elongation(self) -> float:
        """Return the longest axis divided by the shortest."""
        return float(self.ellipsoid.semi_axes[0] / self.ellipsoid.semi_axes[2])

    @property
    def flattening(self) -> float:
        """Return its width across z divided by its height along z, from the second moments of its spheres."""
        mass, radius, place = (self.grains[name] for name in ("mass", "radius", "position"))
        away = place - np.average(place, axis=0, weights=mass)
        x, y, z = np.average(away**2 + radius[:, None] ** 2 / 5, axis=0, weights=mass)
        return float(np.sqrt((x + y) / (2 * z)))

    @cached_property
    def volume(self) -> float:
        """Return the volume of the convex hull of its grains, m^3."""
        return analysis.hull_volume(self.grains["position"], self.grains["radius"])

    @property
    def density(self) -> float:
        """Return its mass divided by that volume, kg/m^3."""
        return float(self.grains["mass"].sum()) / self.volume

    @property
    def magnetisation(self) -> float:
        """Return the magnitude of the total moment divided by that volume, A/m."""
        return float(np.linalg.norm(self.grains["moment"].sum(axis=0))) / self.volume

    @property
    def aligned(self) -> float:
        """Return the magnitude of the total moment over the sum of the magnitudes."""
        moments = self.grains["moment"]
        return float(np.linalg.norm(moments.sum(axis=0)) / np.linalg.norm(moments, axis=1).sum())

    @property
    def spin(self) -> np.ndarray:
        """Return the angular velocity (rad/s) of the rigid body with its inertia and angular momentum."""
        return np.linalg.solve(inertia(self.grains), _momentum(self.grains))


def inertia(grains: Arrays) -> np.ndarray:
    """Return the moment of inertia of spheres as one rigid body about their centre of mass, kg m^2, shape (3,
    3)."""
    mass, radius = grains["mass"], grains["radius"]
    arm = grains["position"] - np.average(grains["position"], axis=0, weights=mass)
    around = float((mass * ((arm**2).sum(axis=1) + 0.4 * radius**2)).sum())
    return np.asarray(around * np.eye(3) - (mass[:, None] * arm).T @ arm)


def _momentum(grains: Arrays) -> np.ndarray:
    return analysis.angular_momentum(
        *(grains[name] for name in ("position", "velocity", "mass", "radius", "spin"))
    )


@dataclass(frozen=True)
class Conserved:
    """Quantities that isolated grains conserve, or lose by contacts.

    momentum, angular : momentum (kg m/s) and angular momentum (kg m^2/s).
    momentum_sum, angular_sum : sums of the magnitudes of their parts.
    kinetic, gravity : kinetic and gravitational energy, J.
    """

    momentum: np.ndarray
    angular: np.ndarray
    momentum_sum: float
    angular_sum: float
    kinetic: float
    gravity: float

    @classmethod
    def of(cls, state: Arrays) -> Conserved:
        """Return the conserved quantities of a state."""
        mass, radius, velocity = state["mass"], state["radius"], state["velocity"]
        inside = 0.4 * mass * radius**2
        spins = (state["spin"] ** 2).sum(axis=1)
        arms = np.linalg.norm(np.cross(state["position"], velocity), axis=1)
        return cls(
            momentum=mass @ velocity,
            angular=_momentum(state),
            momentum_sum=float(mass @ np.linalg.norm(velocity, axis=1)),
            angular_sum=float(mass @ arms + inside @ np.sqrt(spins)),
            kinetic=0.5 * float(mass @ (velocity**2).sum(axis=1) + inside @ spins),
            gravity=analysis.gravitational_energy(state["position"], mass),
        )

    @property
    def energy(self) -> float:
        """Return the sum of kinetic and gravitational energy, J."""
        return self.kinetic + self.gravity


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
