"""Velocities added to the velocities of an initial state."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.components.component import Component, parameter
from tisim.errors import Words, must


class Pulse(Component):
    """The contract of a change of all velocities at the start."""

    contract: ClassVar[bool] = True

    def velocity(self, position: np.ndarray, mass: np.ndarray) -> np.ndarray:
        """Return the added velocities, m/s, (n, 3), given positions, m, and masses, kg, (n,)."""
        raise NotImplementedError(f"{type(self).__name__} must define velocity")

    def top_speed(self, mass: np.ndarray) -> float:
        """Return the largest speed (m/s) added to particles of given masses (kg) at any places; 0 if
        unknown."""
        return 0.0


class Blast(Pulse):
    """A blast gives all particles the same speed away from their centre of mass.

        |dv| = sqrt(2 W/M)

    M is the mass of the particles. The total momentum is not exactly 0 in a random initial state, because the
    unit vectors do not quite cancel. A particle at the centre of mass has no direction to move in: its
    velocity is not changed, and M is the mass of the others.

    Source: Z16 Eqs (3.1)-(3.4).
    """

    energy: float = parameter(
        "J", "energy W: kinetic energy of particles initially at rest", examples=[1.0], gt=0
    )

    def top_speed(self, mass: np.ndarray) -> float:
        return float(np.sqrt(2 * self.energy / mass.sum()))

    def velocity(self, position: np.ndarray, mass: np.ndarray) -> np.ndarray:
        arm = position - np.average(position, axis=0, weights=mass)
        distance = np.linalg.norm(arm, axis=1)
        # Within the rounding error of the coordinates, the direction would be one of rounding errors.
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
