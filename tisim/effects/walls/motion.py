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
    """A motion state holds the quantities of the world that belong to a motion, by name."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        vars(self).update(columns)


class Motion(Component):
    """A motion gives the position and velocity of a rigid body, such as a wall, at any time.

    Shapes are given at the position of the body at time 0, unless the motion shifts it. Most motions are
    functions of time alone. A motion that follows from the forces on the body keeps its state in quantities
    of the world. It lists them in ``quantities``, with their units; kernels find them by name in ``kept``;
    ``end_step`` updates them from the sum of ``resistance``.

    moves : whether the body ever leaves the position of its shapes, or moves at all.
    """

    contract: ClassVar[bool] = True
    moves: ClassVar[bool] = True
    quantities: ClassVar[Mapping[str, str]] = {}

    def centre_of_torque(self) -> Vector:
        """Return the point (m) to which the torque on the body refers; by default the origin."""
        return 0.0, 0.0, 0.0

    def top_speed(self, extent: float) -> float:
        """Return the largest speed (m/s) of the body, which is no larger than an extent (m); 0 if it is not
        known in advance."""
        return 0.0

    def shift(self) -> Vector:
        """Return the displacement (m) of the body from its shapes at time 0."""
        return 0.0, 0.0, 0.0

    def shifts(self, duration: float) -> Sequence[Vector]:
        """Return displacements (m) of the body from its shapes that enclose all displacements in a run of
        some duration (s)."""
        return (self.shift(),)

    def axis(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return a point (m) on the axis of rotation of the body and the direction of the axis; None for a
        body that does not rotate."""
        return None

    @ti.func
    def to_body(self, kept, w, r, t):
        """Return the point of the body frame at a point r (m) in space at time t (s, f64)."""
        return r

    @ti.func
    def from_body(self, kept, w, r, t):
        """Return the point in space of a point r (m) of the body at time t; the inverse of ``to_body``."""
        return r

    @ti.func
    def to_space(self, kept, w, direction, t):
        """Return a direction of the body frame as a direction in space at time t."""
        return direction

    @ti.func
    def velocity_at(self, kept, w, r, t):
        """Return the velocity (m/s) of the body at a point r in space at time t."""
        return 0.0 * r

    @ti.func
    def angular_velocity(self, w):
        """Return the angular velocity (rad/s) of the body."""
        return ti.Vector.zero(float, 3)

    @ti.func
    def fastest(self, w, r, around):
        """Return an upper bound of the speed (m/s) of the body at all points within ``around`` (m) of r in
        space, at any time."""
        return 0.0 * around

    @ti.func
    def resistance(self, w, force):
        """Return the contribution of a force (N) of the body on a particle to the sum that the motion uses.
        It is a whole number, so that the sum over all particles does not depend on their order."""
        return ti.cast(0, ti.i64)

    @ti.func
    def end_step(self, kept, w, total, t):
        """Set the quantities of the world at the end of a step, at time t, given the sum of ``resistance``;
        also once before the first step."""


class Fixed(Motion):
    """The body is at rest at the position of its shapes."""

    moves: ClassVar[bool] = False


def resultant_units(label: str) -> dict[str, str]:
    """Return the unit of each sum that ``resultant`` returns, by name."""
    what = (("force", "N"), ("torque", "N m"))
    return {f"{label}_{name}_{axis}": unit for name, unit in what for axis in "xyz"}


def resultant(
    label: str, position: np.ndarray, force: np.ndarray, torque: np.ndarray, centre: tuple[float, ...]
) -> dict[str, float]:
    """Return the sums of forces (N) and of their torques (N m) about a centre (m), by name, such as
    LABEL_force_x. Forces act at positions (m), with additional torques about these, each of shape (n, 3)."""
    moments = np.cross(position - np.array(centre), force) + torque
    # Exactly rounded sums do not depend on the order.
    sums = (math.fsum(column) for column in np.concatenate([force, moments], axis=1).T)
    return dict(zip(resultant_units(label), sums, strict=True))
