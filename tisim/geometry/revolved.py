"""Surfaces of revolution of straight lines: cylinders, cones and discs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector, option, parameter
from tisim.components.ranges import check_direction
from tisim.geometry.directions import across
from tisim.geometry.shape import same_line
from tisim.geometry.surface import Surface


class RevolvedSurface(Surface):
    """Contract of a surface of revolution, which a line from (rho_1, 0) to (rho_2, L) sweeps around an axis,
    with discs at both ends if closed.

    rho is the distance from the axis and z the coordinate along it. The point nearest to r = (rho, z) is in
    the plane through r and the axis: (rho_1, 0) + u (rho_2 - rho_1, L), with u of the foot of the
    perpendicular, clamped to 0..1.
    """

    contract: ClassVar[bool] = True

    def generator(self) -> tuple[Vector, Vector, float, float, float]:
        """Return the start of the axis (m), its direction, L, rho_1 and rho_2 (m)."""
        raise NotImplementedError

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield from (("origin", 3), ("axis", 3), ("side", 3), ("length", 1), ("low_radius", 1))
        yield "high_radius", 1

    def values(self) -> list[float]:
        origin, direction, *sizes = self.generator()
        axis = np.array(direction) / math.hypot(*direction)
        return [*super().values(), *origin, *axis.tolist(), *across(axis)[0].tolist(), *sizes]

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        origin, direction, length, low, high = self.generator()
        axis = np.array(direction) / math.hypot(*direction)
        # Extent of a circle about the axis along each coordinate, relative to its radius.
        wide = np.sqrt(np.maximum(0.0, 1.0 - axis**2))
        ends = np.array([np.array(origin), np.array(origin) + length * axis])
        sides = np.array([low, high])[:, None] * wide
        return (ends - sides).min(axis=0), (ends + sides).max(axis=0)

    def turns_into_itself(self, centre: np.ndarray, axis: np.ndarray) -> bool:
        origin, direction, *_ = self.generator()
        return same_line(np.array(origin), np.array(direction), centre, axis)

    def distances(self, places: np.ndarray) -> np.ndarray:
        origin, direction, length, low, high = self.generator()
        axis = np.array(direction) / math.hypot(*direction)
        out = places - np.array(origin)
        z = out @ axis
        rho = np.linalg.norm(out - z[:, None] * axis, axis=1)
        # Sections of the faces in a half-plane through the axis: start and end points in rho and z.
        lines = ((low, 0.0, high, length), (0.0, 0.0, low, 0.0), (0.0, length, high, length))
        least: np.ndarray = np.full(len(places), np.inf)
        for near, begin, far, end in lines[: self.face_count]:
            wide, tall = far - near, end - begin
            square = wide * wide + tall * tall
            u = np.clip(((rho - near) * wide + (z - begin) * tall) / (square or 1.0), 0.0, 1.0)
            least = np.minimum(least, np.hypot(rho - near - u * wide, z - begin - u * tall))
        return least

    @ti.func
    def nearest(self, w, k, c, r):
        out, axis, length = r - self.origin(w, k), self.axis(w, k), self.length(w, k)
        z = out.dot(axis)
        across = out - z * axis
        rho = across.norm()
        # On the axis all directions are equally far.
        away = ti.select(rho > 0.0, across / ti.select(rho > 0.0, rho, 1.0), self.side(w, k))
        # Face 0 is the lateral face, the others are end discs from the axis outwards.
        low, high = self.low_radius(w, k), self.high_radius(w, k)
        begin, end = ti.select(c == 2, length, 0.0), ti.select(c == 1, 0.0, length)
        near, far = ti.select(c == 0, low, 0.0), ti.select(c == 1, low, high)
        wide, tall = far - near, end - begin
        # At the apex of a cone the disc is a point.
        square = wide * wide + tall * tall
        u = ((rho - near) * wide + (z - begin) * tall) / ti.select(square > 0.0, square, 1.0)
        u = ti.min(ti.max(u, 0.0), 1.0)
        return self.origin(w, k) + (begin + u * tall) * axis + (near + u * wide) * away


class Barrel(RevolvedSurface):
    """Contract of a surface around a section of an axis, which may be closed at both ends."""

    contract: ClassVar[bool] = True
    envelope: ClassVar[bool] = True

    start: Vector = parameter("m", "start of the axis", (0.0, 0.0, 0.0))
    end: Vector = parameter("m", "end of the axis", examples=[(0.0, 0.0, 1.0)])
    closed: bool = option("whether there are discs at both ends", False)

    @model_validator(mode="after")
    def _long(self) -> Barrel:
        check_direction(f"{self.label}.end - {self.label}.start", self._along())
        return self

    def _along(self) -> Vector:
        x, y, z = (b - a for a, b in zip(self.start, self.end, strict=True))
        return x, y, z

    @property
    def face_count(self) -> int:
        return 3 if self.closed else 1

    def radii(self) -> tuple[float, float]:
        """Return the radii at the start and at the end, m."""
        raise NotImplementedError

    def generator(self) -> tuple[Vector, Vector, float, float, float]:
        return self.start, self._along(), math.hypot(*self._along()), *self.radii()

    def tangent_planes(self) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float, float]]:
        origin, direction, length, low, high = self.generator()
        across, along = length / math.hypot(high - low, length), (low - high) / math.hypot(high - low, length)
        return (
            np.array(origin),
            np.array(direction) / math.hypot(*direction),
            (across, along, across * low, length),
        )

    @ti.func
    def tangents(self, w, k):
        low, length = self.low_radius(w, k), self.length(w, k)
        wide = self.high_radius(w, k) - low
        size = ti.sqrt(wide * wide + length * length)
        across, along = length / size, -wide / size
        return self.origin(w, k), self.axis(w, k), ti.Vector([across, along, across * low, length])
