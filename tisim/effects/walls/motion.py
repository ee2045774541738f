"""The contract of motions of walls, and walls at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component, Vector


@ti.data_oriented
class MotionState:
    """A motion state holds the quantities of the world that a motion keeps, by name."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        vars(self).update(columns)


class Motion(Component):
    """A motion says where a rigid body, such as a wall, is at a time, and how fast it moves.

    At the time 0 the body is where its shapes say, unless the motion says otherwise. Most motions are
    functions of the time alone. One that follows from the forces on the body keeps what it needs in
    quantities of the world: it names them in ``quantities``, with their units, ``kept`` has them in kernels,
    by name, and ``end_step`` sets them, with ``resistance``.

    moves : whether the body is ever elsewhere than its shapes say, or moves at all.
    """

    contract: ClassVar[bool] = True
    moves: ClassVar[bool] = True
    quantities: ClassVar[Mapping[str, str]] = {}

    def centre_of_torque(self) -> Vector:
        """Return the place (m) about which the torque on the body is told; by default the origin."""
        return 0.0, 0.0, 0.0

    def top_speed(self, extent: float) -> float:
        """Return the largest speed (m/s) of the body, which is no larger than an extent (m); 0 where it is
        not known ahead."""
        return 0.0

    def shift(self) -> Vector:
        """Return how far (m) the body is at the time 0 from where its shapes say."""
        return 0.0, 0.0, 0.0

    def shifts(self, duration: float) -> Sequence[Vector]:
        """Return displacements (m) of the body from where its shapes say, between which all of those in a
        run of some duration (s) lie."""
        return (self.shift(),)

    def axis(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return a place (m) on the axis about which the body turns, and the direction of that; None for one
        that does not turn."""
        return None

    @ti.func
    def to_body(self, kept, w, r, t):
        """Return where a place r (m) in space is among the shapes of the body at time t (s, f64)."""
        return r

    @ti.func
    def from_body(self, kept, w, r, t):
        """Return where a place r (m) of the body is in space at time t; the inverse of ``to_body``."""
        return r

    @ti.func
    def to_space(self, kept, w, direction, t):
        """Return a direction of the body as it is in space at time t."""
        return direction

    @ti.func
    def velocity_at(self, kept, w, r, t):
        """Return the velocity (m/s) of the body at a place r in space at time t."""
        return 0.0 * r

    @ti.func
    def angular_velocity(self, w):
        """Return the angular velocity (rad/s) of the body."""
        return ti.Vector.zero(float, 3)

    @ti.func
    def fastest(self, w, r, around):
        """Return a speed (m/s) above that of the body at all places within ``around`` (m) of r in space, at
        any time."""
        return 0.0 * around

    @ti.func
    def resistance(self, w, force):
        """Return what the motion has to know of a force (N) of the body on a particle: a part, summed over
        all particles as a whole number, which is the same in any order."""
        return ti.cast(0, ti.i64)

    @ti.func
    def end_step(self, kept, w, total, t):
        """Set the quantities of the world at the end of a step, at time t, given the sum of
        ``resistance``; once also before the first step."""


class Fixed(Motion):
    """The body rests where its shapes say."""

    moves: ClassVar[bool] = False


def resultant_units(label: str) -> dict[str, str]:
    """Return the unit of each of the sums that ``resultant`` returns, by name."""
    what = (("force", "N"), ("torque", "N m"))
    return {f"{label}_{name}_{axis}": unit for name, unit in what for axis in "xyz"}


def resultant(
    label: str, position: np.ndarray, force: np.ndarray, torque: np.ndarray, centre: tuple[float, ...]
) -> dict[str, float]:
    """Return the sums of forces (N) and of their torques (N m) about a centre (m), by name, such as
    LABEL_force_x. Forces act at positions (m), with torques about these, each of shape (n, 3)."""
    moments = np.cross(position - np.array(centre), force) + torque
    # Exactly rounded sums, so the same in any order.
    sums = (math.fsum(column) for column in np.concatenate([force, moments], axis=1).T)
    return dict(zip(resultant_units(label), sums, strict=True))
