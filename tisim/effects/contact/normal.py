"""The common base of contact laws between overlapping spheres: the geometry of the overlap, and a contract.

Two spheres touch when d <= R_i + R_j. Their surfaces meet in a circle of radius a (Z16 B.1-B.6):

    delta = R_i + R_j - d                       overlap (7.4)
    E = delta / (R_i + R_j)                     overlap strain (7.6)
    L_i = (d - (R_j^2 - R_i^2) / d) / 2         from the centre of i to the plane of the circle (B.6)
    A = pi a^2,  a^2 = R_i^2 - L_i^2            contact area (B.5)
      = (2 R_i + 2 R_j - delta) delta (d^2 - (R_i - R_j)^2) / (4 d^2)

The last form avoids the cancellation of the first at light contact. A sphere inside another has no contact
circle; its area, and every force here, is zero.

The point of contact is the centre of the circle, for both spheres. So L_i + L_j = d, the torques L_i n x F
and L_j n x F of a force F and its reaction balance the moment of the two, and angular momentum is conserved.
(With the radii in place of L it would not be: they add up to more than d.)
"""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, PairForce
from tisim.effects.base.critical_step import (
    critical_step,
    elastic_contact,
    impact_stiffness,
    smallest_grains,
)
from tisim.effects.contact.overlapping_pairs import OverlappingPairs


@ti.func
def overlap(s, w, i, j, distance):
    """Return the overlap delta (m), negative when the two do not touch."""
    return s.radius[w, i] + s.radius[w, j] - distance


@ti.func
def strain(s, w, i, j, distance):
    """Return the overlap strain E of two touching spheres."""
    return overlap(s, w, i, j, distance) / (s.radius[w, i] + s.radius[w, j])


@ti.func
def area(s, w, i, j, distance):
    """Return the contact area A (m^2) of two touching spheres."""
    delta, step = overlap(s, w, i, j, distance), s.radius[w, i] - s.radius[w, j]
    around = (distance + s.radius[w, i] + s.radius[w, j]) * delta
    apart = ti.max(distance * distance - step * step, 0.0)
    return 0.25 * ti.math.pi * around * apart / (distance * distance)


@ti.func
def arm(s, w, i, j, distance):
    """Return the arm L_i (m), from the centre of i to the point of contact."""
    a, b = s.radius[w, i], s.radius[w, j]
    return 0.5 * (distance + (a - b) * (a + b) / distance)


@ti.func
def slip(s, w, i, j, separation, distance):
    """Return the velocity (m/s) of the surface of j relative to the surface of i at the point of contact,
    spin included (7.9, 7.14)."""
    n = separation / distance
    turn = arm(s, w, i, j, distance) * s.spin[w, i] + arm(s, w, j, i, distance) * s.spin[w, j]
    past = s.relative_velocity(w, i, j, separation) - turn.cross(n)
    return past - past.dot(n) * n


class NormalContact(PairForce):
    """This is the contract of a law by which touching spheres repel each other along the line of centres."""

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = True
    # Contacts begin and end.
    kinked: ClassVar[bool] = True
    solid: ClassVar[bool] = True
    # This step control limits the approach of surfaces, but ignores the stiffness of contacts.
    incompatible_controls = ("approach_time",)
    fields = ("radius",)

    def push(self, radius: float, overlap: np.ndarray) -> np.ndarray:
        """Return the repulsive force (N) of two equal spheres of a radius (m) at an array of overlaps (m);
        infinite if a law does not define it."""
        return np.full_like(overlap, math.inf)

    def normal_force(self, pairs: OverlappingPairs) -> np.ndarray:
        """Return the normal force (N) of each pair, without damping; repulsion is positive, and infinity
        stands for a law that does not define it."""
        return np.full(pairs.overlap.shape, np.inf)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        shortest = math.inf
        for _, mass, radius in smallest_grains(start):
            stiffness = impact_stiffness(partial(self.push, radius), 0.5 * mass, 0.5 * radius, speed)
            shortest = min(shortest, critical_step(stiffness, 0.5 * mass))
        return shortest if shortest > 0 else None

    def part_of_critical_step(self, accuracy: float) -> float:
        return elastic_contact(accuracy)

    @ti.func
    def compression(self, s, w, i, j, distance):
        """Return the repulsive force (N, >= 0) of two touching spheres."""
        return 0.0 * distance

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        total = 0.0 * separation
        if distance <= s.radius[w, i] + s.radius[w, j]:
            total = -self.compression(s, w, i, j, distance) / distance * separation
        return total
