"""Ellipsoids and superquadrics in pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tisim.rendering.camera import Raster
from tisim.rendering.solids import SMALLEST_RADIUS, Solids, Splats

ROUNDS = 30
"""Largest number of Newton's steps along a ray; 3 to 8 are usual."""
ON_SURFACE = 1e-5
"""A point counts as on the surface if the sum of powers differs from 1 by less."""


@dataclass(frozen=True, kw_only=True)
class DrawnSuperquadrics(Solids):
    """Superquadrics, |x/a_1|^g_1 + |y/a_2|^g_2 + |z/a_3|^g_3 = 1 in the frame of each.

    turn : matrix whose columns are the axes of the frame, shape (n, 3, 3). semi_axes : m, shape (n, 3).
    exponents : 2 or more, shape (n, 3).
    """

    turn: np.ndarray
    semi_axes: np.ndarray
    exponents: np.ndarray

    def sizes(self) -> np.ndarray:
        around: np.ndarray = np.linalg.norm(self.semi_axes, axis=1)
        return around

    def seen_on(self, raster: Raster) -> Self:
        turn = np.einsum("ka,nkb->nab", raster.camera.axes, self.turn)
        semi_axes = np.maximum(self.semi_axes * raster.scale, SMALLEST_RADIUS)
        return replace(self, centre=raster.place(self.centre), turn=turn, semi_axes=semi_axes)

    def splats(self) -> Splats:
        spread = np.einsum("nka,na->nk", np.abs(self.turn), self.semi_axes)
        return Splats(np.arange(len(self)), self.centre - spread, self.centre + spread)

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return z of the entry.

        In the frame scaled by the semi-axes a ray is q + z e. It enters the box |q_k + z e_k| <= 1 where the
        sum of powers is 1 to 3. The sum is convex in z, so Newton's method from there moves monotonically to
        the entry, or past the least value if the ray misses.
        """
        k, x, y = np.broadcast_arrays(k, x, y)
        shape, k = k.shape, k.ravel()
        u, v = (x.ravel() - self.centre[k, 0])[:, None], (y.ravel() - self.centre[k, 1])[:, None]
        turn, a, g = self.turn[k], self.semi_axes[k], self.exponents[k]
        q, e = (u * turn[:, 0] + v * turn[:, 1]) / a, turn[:, 2] / a
        e = np.where(np.abs(e) < 1e-12, 1e-12, e)
        ends = np.stack([(1 - q) / e, (-1 - q) / e])
        z, low = ends.max(axis=0).min(axis=1), ends.min(axis=0).max(axis=1)
        found = np.full(len(k), -np.inf)
        rows = np.flatnonzero(z >= low)
        for _ in range(ROUNDS):
            place = np.abs(q[rows] + z[rows, None] * e[rows])
            powers = place ** (g[rows] - 1)
            level = (powers * place).sum(axis=1) - 1
            slope = (g[rows] * powers * np.sign(q[rows] + z[rows, None] * e[rows]) * e[rows]).sum(axis=1)
            done = level < ON_SURFACE
            found[rows[done]] = z[rows[done]]
            going = ~done & (slope > 0)
            rows = rows[going]
            if not len(rows):
                break
            z[rows] -= level[going] / slope[going]
            rows = rows[z[rows] >= low[rows]]
        return (found + self.centre[k, 2]).reshape(shape)

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        out = np.einsum("nka,nk->na", self.turn[k], point - self.centre[k]) / self.semi_axes[k]
        g = self.exponents[k]
        along = g * np.abs(out) ** (g - 1) * np.sign(out) / self.semi_axes[k]
        normal: np.ndarray = np.einsum("nka,na->nk", self.turn[k], along)
        return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
