"""Triangles and lines in pictures: walls, and their edges."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tisim.rendering.camera import Raster
from tisim.rendering.solids import Solids, Splats

SLIVER = 1e-9
"""Relative tolerance of the edges of triangles, so that there is no gap between neighbours."""


@dataclass(frozen=True, kw_only=True)
class DrawnTriangles(Solids):
    """Triangles of surfaces. corners : m, shape (n, 3, 3); ``centre`` is their mean."""

    corners: np.ndarray

    @classmethod
    def of(cls, corners: np.ndarray, colour: np.ndarray) -> Self:
        """Return triangles with corners (m), shape (n, 3, 3), of a colour, shape (3,) or (n, 3)."""
        corners = np.asarray(corners, float).reshape(-1, 3, 3)
        tints = np.broadcast_to(colour, (len(corners), 3))
        return cls(centre=corners.mean(axis=1), colour=tints, corners=corners)

    def sizes(self) -> np.ndarray:
        sides = self.corners[:, 1:] - self.corners[:, :1]
        return np.asarray(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1))

    def seen_on(self, raster: Raster) -> Self:
        return replace(self, centre=raster.place(self.centre), corners=raster.place(self.corners))

    def splats(self) -> Splats:
        return Splats(np.arange(len(self)), self.corners.min(axis=1), self.corners.max(axis=1))

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        first = self.corners[k, 0]
        (bx, by, bz), (cx, cy, cz) = (np.moveaxis(self.corners[k, m] - first, -1, 0) for m in (1, 2))
        u, v = x - first[..., 0], y - first[..., 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            area = bx * cy - by * cx
            second, third = u * (cy / area) - v * (cx / area), v * (bx / area) - u * (by / area)
            inside = (second >= -SLIVER) & (third >= -SLIVER) & (second + third <= 1 + SLIVER)
        return np.where(inside, first[..., 2] + second * bz + third * cz, -np.inf)

    def bottom(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        # A triangle has no thickness.
        at = self.top(k, x, y)
        return np.where(np.isneginf(at), np.inf, at)

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Return unit normals towards the viewer: both sides of a wall look alike."""
        sides = self.corners[k, 1:] - self.corners[k, :1]
        normal = np.cross(sides[:, 0], sides[:, 1])
        normal *= np.where(normal[:, 2:] < 0, -1, 1)
        return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))


@dataclass(frozen=True, kw_only=True)
class DrawnLines(Solids):
    """Straight lines of some width in pixels. ends : m, shape (n, 2, 3). width : pixels, shape (n,)."""

    ends: np.ndarray
    width: np.ndarray

    @classmethod
    def of(cls, ends: np.ndarray, colour: np.ndarray, width: float) -> Self:
        """Return lines with ends (m), shape (n, 2, 3), of one colour and width (pixels)."""
        ends = np.asarray(ends, float).reshape(-1, 2, 3)
        tints = np.broadcast_to(colour, (len(ends), 3))
        return cls(centre=ends.mean(axis=1), colour=tints, ends=ends, width=np.full(len(ends), width))

    def sizes(self) -> np.ndarray:
        return np.asarray(np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=1))

    def seen_on(self, raster: Raster) -> Self:
        return replace(self, centre=raster.place(self.centre), ends=raster.place(self.ends))

    def splats(self) -> Splats:
        """Return boxes along each line."""
        way = self.ends[:, 1] - self.ends[:, 0]
        reach = np.linalg.norm(way[:, :2], axis=1)
        count = np.minimum(np.ceil(reach / np.maximum(4 * self.width, 16)), 4096).astype(int) + 1
        solid = np.repeat(np.arange(len(self)), count)
        rank = np.arange(len(solid)) - np.repeat(np.cumsum(count) - count, count)
        first, last = rank / count[solid], (rank + 1) / count[solid]
        ends = self.ends[solid, :1] + np.stack([first, last], axis=1)[..., None] * way[solid, None]
        width = self.width[solid, None]
        return Splats(solid, ends.min(axis=1) - width, ends.max(axis=1) + width)

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        start, end = self.ends[k, 0], self.ends[k, 1]
        wx, wy = end[..., 0] - start[..., 0], end[..., 1] - start[..., 1]
        u, v = x - start[..., 0], y - start[..., 1]
        square = np.maximum(wx * wx + wy * wy, 1e-300)
        part = np.clip((u * wx + v * wy) / square, 0, 1)
        near = (u - part * wx) ** 2 + (v - part * wy) ** 2 <= (self.width[k] / 2) ** 2
        return np.where(near, start[..., 2] + part * (end[..., 2] - start[..., 2]), -np.inf)

    def bottom(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        at = self.top(k, x, y)
        return np.where(np.isneginf(at), np.inf, at)

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Return the direction to the viewer: lines have no shading."""
        return np.broadcast_to(np.array([0.0, 0.0, 1.0]), (len(k), 3))
