"""The contract of containers of hard bodies."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component

Axes = tuple[bool, bool, bool]
"""A value for each axis: x, y and z."""


class Container(Component):
    """A container is a convex region between walls within the box of the domain: the contract of containers.

    A packing stepper brings bodies closer together by letting them grow. Lengths of a container that keep
    their ratio to the bodies are parameters in units of D, the shortest side of the box around the first
    shape; the others are sides of the box. Kernels and NumPy get positions relative to the lower corner of
    the box (m), the sides of the box (m), and D (m).

    curved : whether a wall is curved, so that only bodies with round ends touch it at points that are known
    in closed form.
    """

    contract: ClassVar[bool] = True
    curved: ClassVar[bool] = False

    def walled(self) -> Axes:
        """Return the axes along which walls confine bodies. The box must be periodic along the others."""
        raise NotImplementedError(f"{type(self).__name__} must define walled")

    def scaled(self) -> Axes:
        """Return the axes along which the container grows with the bodies; by default none."""
        return False, False, False

    def walls(self) -> int:
        """Return the number of walls."""
        raise NotImplementedError(f"{type(self).__name__} must define walls")

    def volume_in(self, side: np.ndarray, unit: float) -> float:
        """Return the volume (m^3), for a box of some sides (m, shape (3,)) and D (m)."""
        raise NotImplementedError(f"{type(self).__name__} must define volume_in")

    def box_of(self, volume: float, unit: float) -> np.ndarray:
        """Return the sides (m, shape (3,)) of the box of a container of some volume (m^3), for D (m)."""
        raise NotImplementedError(f"{type(self).__name__} must define box_of")

    def check_box(self, side: np.ndarray) -> None:
        """Raise InputError if the container does not fit a box of some sides (m, shape (3,)); by default it
        fits all."""

    def distances(self, places: np.ndarray, side: np.ndarray, unit: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance (m) of points from each wall, negative behind it, shape (n, walls), and the
        unit normal of the wall at its nearest point, away from the container, shape (n, walls, 3).

        places : m from the lower corner of the box, shape (n, 3). side : sides of the box (m, shape (3,)).
        unit : D (m).
        """
        raise NotImplementedError(f"{type(self).__name__} must define distances")

    def points(self, numbers: np.ndarray, side: np.ndarray, unit: float, margin: float) -> np.ndarray:
        """Return the points (m from the lower corner of the box, shape (n, 3)) to which random numbers in
        0..1, shape (n, 3), are mapped: uniformly distributed over all points at least ``margin`` (m) away
        from the walls."""
        raise NotImplementedError(f"{type(self).__name__} must define points")

    def triangles(self, side: np.ndarray, unit: float) -> np.ndarray:
        """Return the corners of triangles that approximate the walls, m from the lower corner of the box,
        shape (triangles, 3, 3), for pictures; by default there are none.

        side : sides of the box (m, shape (3,)). unit : D (m).
        """
        return np.empty((0, 3, 3))

    @ti.func
    def volume(self, w, side, unit):
        """Return the volume (m^3)."""
        return side[0] * side[1] * side[2]

    @ti.func
    def centre(self, w, side):
        """Return the point (m) from which the container grows."""
        return 0.5 * side

    @ti.func
    def wall(self, w, k, place, side, unit):
        """Return the distance (m) of a point from wall k, negative behind it, and the unit normal of the wall
        at its nearest point, away from the container."""
        return side[0], side

    @ti.func
    def along(self, w, k, outward):
        """Return a unit vector in wall k, along which virtual bodies are aligned."""
        return outward
