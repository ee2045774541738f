"""Measures of a cloud of grains and of the asteroid in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tisim.analysis import (
    Ellipsoid,
    angular_momentum,
    bounding_ellipsoid,
    cluster_shapes,
    contacts,
    fraction_in_clusters,
    gravitational_energy,
    head_to_tail,
    hull_volume,
    labels,
)
from tisim.scene.initial_state import Arrays

GAP = 0.01
"""Largest gap between the surfaces of bound grains, in units of the smallest diameter."""
CLUMP = 11
"""Least number of grains in a clump: more than ten."""


def clusters_of(state: Arrays) -> np.ndarray:
    """Return the cluster of each grain, as connected by contacts; shape (n,)."""
    radius = state["radius"]
    gap = GAP * 2 * float(radius.min())
    return labels(len(radius), contacts(state["position"], radius, gap))


def body(cluster: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return a mask of the grains in the heaviest cluster, the asteroid; shape (n,)."""
    return np.asarray(cluster == np.bincount(cluster, mass).argmax())


def part(state: Arrays, some: np.ndarray) -> Arrays:
    """Return the state of some of the grains."""
    return {name: values[some] for name, values in state.items()}


def chain_length(state: Arrays) -> float:
    """Return the mean number of grains along the chain of each grain, without the seed; NaN without moments.

    A chain consists of grains whose moments bind them head to tail.
    """
    radius = state["radius"]
    grains = part(state, radius == radius.min())
    if "moment" not in grains or not grains["moment"].any():
        return float("nan")
    diameter = 2 * float(radius.min())
    shapes = cluster_shapes(grains["position"], head_to_tail(grains["position"], grains["moment"], diameter))
    return float(np.average(shapes.path, weights=shapes.size))


@dataclass(frozen=True)
class Gathering:
    """The progress of agglomeration in a cloud.

    coalesced : fraction of all grains that are in the asteroid.
    some, many : fractions of the other grains in clusters of two or more and of more than ten; NaN without
    other grains.
    chain : mean length of chains, in grains.
    """

    coalesced: float
    some: float
    many: float
    chain: float

    @classmethod
    def of(cls, state: Arrays) -> Gathering:
        """Return the progress of agglomeration in a state."""
        cluster = clusters_of(state)
        inside = body(cluster, state["mass"])
        # A single grain is not an asteroid.
        inside &= inside.sum() > 1
        others = cluster[~inside]
        some, many = (fraction_in_clusters(others, least) for least in (2, CLUMP))
        return cls(float(inside.mean()), some, many, chain_length(state))

    @property
    def bound(self) -> float:
        """Return the fraction of all grains that are in clusters of two or more."""
        return self.coalesced + (0.0 if self.coalesced == 1 else (1 - self.coalesced) * self.some)


@dataclass(frozen=True)
class Asteroid:
    """The grains of an asteroid, and its bounding ellipsoid."""

    grains: Arrays
    ellipsoid: Ellipsoid

    @classmethod
    def of(cls, state: Arrays) -> Asteroid:
        """Return the asteroid in a state; it must have at least two grains."""
        grains = part(state, body(clusters_of(state), state["mass"]))
        return cls(grains, bounding_ellipsoid(grains["position"], grains["radius"]))

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
        return hull_volume(self.grains["position"], self.grains["radius"])

    @property
    def density(self) -> float:
        """Return its mass divided by that volume, kg/m^3."""
        return float(self.grains["mass"].sum()) / self.volume

    @property
    def magnetisation(self) -> float:
        """Return the magnitude of the total moment divided by that volume, A/m."""
        return float(np.linalg.norm(self.grains["moment"].sum(axis=0))) / self.volume

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
    return angular_momentum(*(grains[name] for name in ("position", "velocity", "mass", "radius", "spin")))


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
            gravity=gravitational_energy(state["position"], mass),
        )

    @property
    def energy(self) -> float:
        """Return the sum of kinetic and gravitational energy, J."""
        return self.kinetic + self.gravity
