"""Solids that pictures show: the ray through a pixel meets each in closed form.

Positions and lengths are in the pixels of a raster (``seen_on``): x right, y up, z towards the viewer. A ray
runs along z through a point (x, y). ``top`` is the z at which it enters a solid, -inf if it misses it. All
solids are symmetric about their centres, so a ray leaves one at the point opposite to the entry of the
mirrored ray.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from tisim.rendering.camera import Raster

GRAZING = 1e-12
"""A ray whose squared sine to an axis is smaller runs along the axis."""
SMALLEST_DRAWN = 2.0
"""Smallest radius of a solid on a raster, in its pixels, so that it is visible."""


@dataclass(frozen=True)
class Splats:
    """Boxes that together contain solids.

    solid : index of the solid of each, shape (m,). low, high : corners in pixels, shape (m, 3).
    """

    solid: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Solids:
    """Solids of one kind.

    centre : m, shape (n, 3). colour : red, green and blue, 0..1, shape (n, 3). slow : whether ``top`` takes
    much longer than the comparison of depths.
    """

    slow: ClassVar[bool] = False

    centre: np.ndarray
    colour: np.ndarray

    def __len__(self) -> int:
        return len(self.centre)

    def sizes(self) -> np.ndarray:
        """Return the radius (m) of a sphere around each, shape (n,)."""
        raise NotImplementedError

    def where(self, kept: np.ndarray) -> Self:
        """Return some of the solids, by index or by truth value."""
        return replace(self, **{name: values[kept] for name, values in vars(self).items()})

    def finite(self) -> Self:
        """Return the solids without those whose position or size is not finite, or whose size is 0."""
        if not len(self):
            return self
        rows = [values.reshape(len(self), -1) for values in vars(self).values()]
        return self.where(np.isfinite(np.hstack(rows)).all(axis=1) & (self.sizes() > 0))

    def seen_on(self, raster: Raster) -> Self:
        """Return the solids in the pixels of a raster."""
        raise NotImplementedError

    def splats(self) -> Splats:
        """Return boxes that contain the solids."""
        raise NotImplementedError

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the z at which rays at (x, y) enter solids k; -inf if they miss them."""
        raise NotImplementedError

    def bottom(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the z at which rays leave the solids; inf if they miss them."""
        across, upwards, towards = (self.centre[k, axis] for axis in range(3))
        below: np.ndarray = 2 * towards - self.top(k, 2 * across - x, 2 * upwards - y)
        return below

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Return the outward unit normals of solids k at points of their surfaces, shape (m, 3)."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class DrawnSpheres(Solids):
    """Spheres. radius : m, shape (n,)."""

    radius: np.ndarray

    def sizes(self) -> np.ndarray:
        return self.radius

    def seen_on(self, raster: Raster) -> Self:
        radius = np.maximum(self.radius * raster.scale, SMALLEST_DRAWN)
        return replace(self, centre=raster.place(self.centre), radius=radius)

    def splats(self) -> Splats:
        r = self.radius[:, None]
        return Splats(np.arange(len(self)), self.centre - r, self.centre + r)

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        u, v = x - self.centre[k, 0], y - self.centre[k, 1]
        square = self.radius[k] ** 2 - u * u - v * v
        with np.errstate(invalid="ignore"):
            return np.where(square > 0, self.centre[k, 2] + np.sqrt(square), -np.inf)

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        outward: np.ndarray = (point - self.centre[k]) / self.radius[k, None]
        return outward


@dataclass(frozen=True, kw_only=True)
class _Swept(Solids):
    """Solids around a segment.

    axis : unit vector, shape (n, 3). half : half the length of the segment, m, shape (n,). radius : m, shape
    (n,).
    """

    axis: np.ndarray
    half: np.ndarray
    radius: np.ndarray

    def sizes(self) -> np.ndarray:
        around: np.ndarray = np.hypot(self.half + self.radius, self.radius)
        return around * (self.radius > 0)

    def seen_on(self, raster: Raster) -> Self:
        radius = np.maximum(self.radius * raster.scale, SMALLEST_DRAWN)
        return replace(
            self, centre=raster.place(self.centre), axis=raster.camera.project(self.axis),
            half=self.half * raster.scale, radius=radius,
        )  # fmt: skip

    def splats(self) -> Splats:
        """Return boxes along the segment, because the box around an inclined rod is mostly empty."""
        reach = np.linalg.norm(self.axis[:, :2], axis=1) * self.half
        count = np.ceil(reach / self.radius).astype(int) + 1
        solid = np.repeat(np.arange(len(self)), count)
        rank = np.arange(len(solid)) - np.repeat(np.cumsum(count) - count, count)
        piece = self.half / count
        middle = (2 * rank + 1 - count[solid]) * piece[solid]
        centre = self.centre[solid] + middle[:, None] * self.axis[solid]
        # A flat end reaches less far than a sphere at the end.
        spread = self.radius[solid, None] + piece[solid, None] * np.abs(self.axis[solid])
        return Splats(solid, centre - spread, centre + spread)

    def _round(
        self, k: np.ndarray, x: np.ndarray, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return for rays the coordinate along the axis at z = 0 and its slope, and the entry into the
        infinite cylinder and its exit, z relative to the centre; both are inf for rays along the axis within
        it, and NaN for rays that miss it."""
        u, v = x - self.centre[k, 0], y - self.centre[k, 1]
        along = u * self.axis[k, 0] + v * self.axis[k, 1]
        slope = self.axis[k, 2]
        a, b = 1 - slope * slope, -slope * along
        c = u * u + v * v - along * along - self.radius[k] ** 2
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(b * b - a * c)
            parallel = a < GRAZING
            inside = np.where(c < 0, np.inf, np.nan)
            entry = np.where(parallel, inside, (-b + root) / a)
            leave = np.where(parallel, -inside, (-b - root) / a)
        return along, slope, entry, leave


@dataclass(frozen=True, kw_only=True)
class DrawnRods(_Swept):
    """Spherocylinders: all points within ``radius`` of a segment."""

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        along, slope, entry, _ = self._round(k, x, y)
        with np.errstate(invalid="ignore"):
            at = along + np.where(np.isinf(entry), np.sign(slope) * np.inf, entry * slope)
            end = np.sign(at) * self.half[k]
            u = x - self.centre[k, 0] - end * self.axis[k, 0]
            v = y - self.centre[k, 1] - end * self.axis[k, 1]
            cap = end * slope + np.sqrt(self.radius[k] ** 2 - u * u - v * v)
            z = np.where(np.abs(at) <= self.half[k], entry, cap)
        return np.where(np.isnan(z), -np.inf, self.centre[k, 2] + z)

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        out = point - self.centre[k]
        at = np.clip((out * self.axis[k]).sum(axis=1), -self.half[k], self.half[k])
        normal: np.ndarray = (out - at[:, None] * self.axis[k]) / self.radius[k, None]
        return normal


@dataclass(frozen=True, kw_only=True)
class DrawnCylinders(_Swept):
    """Cylinders with flat ends, such as magnets and fibres."""

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        along, slope, entry, leave = self._round(k, x, y)
        half = self.half[k]
        with np.errstate(invalid="ignore", divide="ignore"):
            across = np.abs(slope) < np.sqrt(GRAZING)
            beside = np.where(np.abs(along) <= half, np.inf, np.nan)
            first, second = (half - along) / slope, (-half - along) / slope
            high = np.where(across, beside, np.maximum(first, second))
            low = np.where(across, -beside, np.minimum(first, second))
            z, below = np.minimum(entry, high), np.maximum(leave, low)
            return np.where(z >= below, self.centre[k, 2] + z, -np.inf)

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        out = point - self.centre[k]
        at = (out * self.axis[k]).sum(axis=1)[:, None]
        outward = out - at * self.axis[k]
        rho = np.linalg.norm(outward, axis=1, keepdims=True)
        flat = np.abs(at) - self.half[k, None] > rho - self.radius[k, None]
        normal: np.ndarray = np.where(flat, np.sign(at) * self.axis[k], outward / np.maximum(rho, 1e-300))
        return normal
