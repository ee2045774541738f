"""The bodies and walls that a fluid flows around, and their distances from the faces of a grid."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, Protocol

import numpy as np
from scipy.fft import next_fast_len

from tisim.components.component import Vector

Column = Literal["none", "duct", "tube"]
"""The walls around a matrix: none; a rectangular duct; a round tube."""
WINDOW_CELLS = 3
"""Cells around a body in which distances from it are evaluated."""


class SolidBody(Protocol):
    """A solid body.

    width : the smallest distance (m) between two opposite points of its surface, such as a diameter.
    """

    @property
    def width(self) -> float: ...

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner of a box around it (m), shape (3,) each."""

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the distances of points (m, shape (..., 3)) from its surface, negative inside, shape
        (...)."""


@dataclass(frozen=True)
class SolidSphere:
    """A solid sphere; lengths in m."""

    centre: Vector
    radius: float

    @property
    def width(self) -> float:
        return 2 * self.radius

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        centre = np.array(self.centre)
        return centre - self.radius, centre + self.radius

    def distances(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(np.linalg.norm(points - self.centre, axis=-1) - self.radius)


@dataclass(frozen=True)
class SolidCylinder:
    """A solid cylinder with flat ends, or with half spheres beyond them if it is ``round``; lengths in m.

    axis : unit vector. length : from end to end, without half spheres.
    """

    centre: Vector
    axis: Vector
    radius: float
    length: float
    round: bool = False

    @property
    def width(self) -> float:
        return 2 * self.radius if self.round else min(2 * self.radius, self.length)

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        centre, axis = np.array(self.centre), np.array(self.axis)
        across = 1.0 if self.round else np.sqrt(np.maximum(1 - axis**2, 0))
        half = 0.5 * self.length * np.abs(axis) + self.radius * across
        return centre - half, centre + half

    def distances(self, points: np.ndarray) -> np.ndarray:
        out = points - self.centre
        along = out @ np.array(self.axis)
        beyond = np.abs(along) - 0.5 * self.length
        if self.round:
            foot = np.clip(along, -0.5 * self.length, 0.5 * self.length)
            return np.asarray(
                np.linalg.norm(out - foot[..., None] * np.array(self.axis), axis=-1) - self.radius
            )
        side = np.linalg.norm(out - along[..., None] * np.array(self.axis), axis=-1) - self.radius
        outside = np.hypot(np.maximum(side, 0), np.maximum(beyond, 0))
        return np.asarray(outside + np.minimum(np.maximum(side, beyond), 0))


@dataclass(frozen=True)
class Grid:
    """A periodic staggered grid over a box, which continues within walls if the box has any.

    low : lower corner (m). spacing : sides of a cell (m), shape (3,). cells : of the box along each axis.
    column, axis : its walls, and the axis (0, 1 or 2) along which a duct or a tube is open.

    The face of a cell that has its normal along an axis and is nearer to ``low`` holds the component of the
    velocity along this axis.
    """

    low: np.ndarray
    spacing: np.ndarray
    cells: tuple[int, int, int]
    column: Column
    axis: int

    @property
    def walled(self) -> tuple[bool, bool, bool]:
        """Return the axes along which the box has walls."""
        x, y, z = (self.column != "none" and b != self.axis for b in range(3))
        return x, y, z

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the cells along each axis, with one or more cells inside the walls."""
        x, y, z = (
            int(next_fast_len(n + 1, real=True)) if wall else n
            for n, wall in zip(self.cells, self.walled, strict=True)
        )
        return x, y, z

    def offset(self, component: int | None, axis: int) -> float:
        """Return the coordinate (m) along an axis of the first face with a component of the velocity, or of
        the first corner of a cell for None."""
        return float(self.low[axis] + (0.0 if component in (axis, None) else 0.5 * self.spacing[axis]))

    def coordinates(self, component: int | None) -> list[np.ndarray]:
        """Return the coordinates (m) along each axis of the faces with a component, or of corners."""
        return [self.offset(component, b) + self.spacing[b] * np.arange(n) for b, n in enumerate(self.shape)]

    def distances(self, component: int | None, solids: Sequence[SolidBody]) -> np.ndarray:
        """Return the distances (m) of the faces with a component, or of the corners of cells, from the
        nearest surface, negative in bodies and walls, with the shape of the grid; a large distance beyond
        ``WINDOW_CELLS`` from all surfaces.

        Bodies continue periodically, except through walls.
        """
        places = self.coordinates(component)
        least = self._from_walls(places)
        for solid in solids:
            for own, images in self._windows(component, solid):
                points = np.stack(
                    np.meshgrid(*(p[s] for p, s in zip(places, own, strict=True)), indexing="ij"), -1
                )
                least[own] = np.minimum(least[own], solid.distances(points - images))
        return least

    def _windows(
        self, component: int | None, solid: SolidBody
    ) -> Iterator[tuple[tuple[slice, ...], np.ndarray]]:
        """Yield the blocks of faces near a body and its periodic images, each with the shift (m) of the
        image."""
        low, high = solid.extent()
        blocks: list[list[tuple[slice, float]]] = []
        for b, n in enumerate(self.shape):
            offset = self.offset(component, b)
            first = int(np.floor((low[b] - offset) / self.spacing[b])) - WINDOW_CELLS
            last = int(np.ceil((high[b] - offset) / self.spacing[b])) + WINDOW_CELLS
            turns = range(first // n, last // n + 1) if not self.walled[b] else range(1)
            ranges = [(max(first - k * n, 0), min(last - k * n, n - 1) + 1, k) for k in turns]
            blocks.append([(slice(i, j), -k * n * float(self.spacing[b])) for i, j, k in ranges if i < j])
        for x, y, z in product(*blocks):
            yield (x[0], y[0], z[0]), np.array([x[1], y[1], z[1]])

    def _from_walls(self, places: list[np.ndarray]) -> np.ndarray:
        """Return the distances (m) from walls alone."""
        high = self.low + self.spacing * self.cells
        least = np.full(self.shape, 4.0 * self.spacing.max() * WINDOW_CELLS)
        if self.column == "tube":
            out = []
            for b in (axis for axis in range(3) if self.walled[axis]):
                period = self.shape[b] * self.spacing[b]
                from_middle = places[b] - 0.5 * (self.low[b] + high[b])
                out.append(self._along(b, from_middle - period * np.rint(from_middle / period)))
            radius = 0.5 * min((high - self.low)[np.flatnonzero(self.walled)])
            return np.broadcast_to(radius - np.hypot(*out), self.shape).copy()
        for b in (axis for axis in range(3) if self.walled[axis]):
            again = self.low[b] + self.shape[b] * self.spacing[b]
            inside = np.minimum(places[b] - self.low[b], high[b] - places[b])
            within = np.where(
                places[b] <= high[b], inside, -np.minimum(places[b] - high[b], again - places[b])
            )
            least = np.minimum(least, self._along(b, within))
        return least

    @staticmethod
    def _along(axis: int, values: np.ndarray) -> np.ndarray:
        return np.expand_dims(values, tuple(b for b in range(3) if b != axis))
