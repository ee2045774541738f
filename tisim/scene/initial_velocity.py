"""Velocities that a start is given at once, on top of those that it has."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.components.component import Component, parameter
from tisim.errors import Words, must


class Pulse(Component):
    """This is the contract of a change of all velocities at the start."""

    contract: ClassVar[bool] = True

    def velocity(self, position: np.ndarray, mass: np.ndarray) -> np.ndarray:
        """Return what is added to velocities, m/s, (n, 3), given positions, m, and masses, kg, (n,)."""
        raise NotImplementedError(f"{type(self).__name__} must define velocity")

    def top_speed(self, mass: np.ndarray) -> float:
        """Return the largest speed (m/s) that it adds to particles of some masses (kg), wherever they are; 0
        where it is not known."""
        return 0.0


class Blast(Pulse):
    """A blast gives all particles the same speed away from their centre of mass.

        |dv| = sqrt(2 W/M)

    M is the mass of the particles. Total momentum is that of the unit vectors, which do not quite cancel in a
    random start. A particle in the centre of mass, which has no direction to go, stays as it is, and M is the
    mass of the others.

    Source: Z16 Eqs (3.1)-(3.4).
    """

    energy: float = parameter(
        "J", "energy W: the kinetic energy of particles that were at rest", examples=[1.0], gt=0
    )

    def top_speed(self, mass: np.ndarray) -> float:
        return float(np.sqrt(2 * self.energy / mass.sum()))

    def velocity(self, position: np.ndarray, mass: np.ndarray) -> np.ndarray:
        arm = position - np.average(position, axis=0, weights=mass)
        distance = np.linalg.norm(arm, axis=1)
        # Nearer than the rounding of the coordinates, a direction would be one of rounding errors.
        moved = distance > 1e-12 * np.abs(position).max(initial=0.0)
        must(
            bool(moved.any()),
            "particles of a blast",
            "apart from their centre of mass",
            Words(f"{len(mass)} in it"),
        )
        speed = np.sqrt(2 * self.energy / mass[moved].sum())
        pulse = np.zeros_like(position)
        pulse[moved] = speed * arm[moved] / distance[moved, None]
        return pulse
