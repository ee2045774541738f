"""Ellipsoids and superquadrics in pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from typing import ClassVar, Self

import numpy as np

from tisim.rendering.camera import Raster
from tisim.rendering.solids import SMALLEST_DRAWN, Solids, Splats

RAY_STEPS = 30
"""Largest number of Newton's steps along a ray; 3 to 8 are usual."""
ON_SURFACE = 1e-5
"""A point counts as on the surface if the sum of powers differs from 1 by less."""


@dataclass(frozen=True, kw_only=True)
class DrawnSuperquadrics(Solids):
    """Superquadrics, |x/a_1|^g_1 + |y/a_2|^g_2 + |z/a_3|^g_3 = 1 in the frame of each.

    turn : matrix whose columns are the axes of the frame, shape (n, 3, 3). semi_axes : m, shape (n, 3).
    exponents : 2 or more, shape (n, 3).
    """

    slow: ClassVar[bool] = True

    turn: np.ndarray
    semi_axes: np.ndarray
    exponents: np.ndarray

    def sizes(self) -> np.ndarray:
        around: np.ndarray = np.linalg.norm(self.semi_axes, axis=1)
        return around

    def seen_on(self, raster: Raster) -> Self:
        turn = np.einsum("ka,nkb->nab", raster.camera.axes, self.turn)
        semi_axes = np.maximum(self.semi_axes * raster.scale, SMALLEST_DRAWN)
        return replace(self, centre=raster.place(self.centre), turn=turn, semi_axes=semi_axes)

    def splats(self) -> Splats:
        """Return boxes around the superquadrics: exact ones if all exponents of a body are equal, and
        otherwise as for the largest of them.

        A superquadric of exponents g extends to the norm of a n with the exponent g/(g - 1) along n.
        """
        power = (1 + 1 / (self.exponents.max(axis=1) - 1))[:, None, None]
        reach = np.abs(self.turn) * self.semi_axes[:, None, :]
        most = reach.max(axis=2, keepdims=True)
        spread = most[..., 0] * ((reach / most) ** power).sum(axis=2) ** (1 / power[..., 0])
        return Splats(np.arange(len(self)), self.centre - spread, self.centre + spread)

    def top(self, k: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return z of the entry.

        In the frame scaled by the semi-axes a ray is q + z e. At its entry into the box |q_k + z e_k| <= 1
        the sum of powers is 1 to 3. The sum is convex in z, so Newton's method from there moves
        monotonically to the entry, or past the least value if the ray misses.
        """
        k, x, y = np.broadcast_arrays(k, x, y)
        shape, k = k.shape, k.ravel()
        u, v = x.ravel() - self.centre[k, 0], y.ravel() - self.centre[k, 1]
        frame = self.turn / self.semi_axes[:, None, :]
        # Components one after another: sums over a last axis of three are slow.
        q = [u * frame[k, 0, c] + v * frame[k, 1, c] for c in range(3)]
        e = [np.where(np.abs(frame[:, 2, c]) < 1e-12, 1e-12, frame[:, 2, c])[k] for c in range(3)]
        inverse = [1 / one for one in e]
        z = reduce(np.minimum, (np.abs(i) - a * i for a, i in zip(q, inverse, strict=True)))
        low = reduce(np.maximum, (-np.abs(i) - a * i for a, i in zip(q, inverse, strict=True)))
        found = np.full(len(k), -np.inf)
        rows = np.flatnonzero(z >= low)
        q, e, z, low = [a[rows] for a in q], [a[rows] for a in e], z[rows], low[rows]
        g = [self.exponents[k[rows], c] for c in range(3)]
        for _ in range(RAY_STEPS):
            level, slope = -1.0, 0.0
            for a, b, power in zip(q, e, g, strict=True):
                place = a + z * b
                size = np.abs(place)
                term = size ** (power - 1)
                level = level + term * size
                slope = slope + power * term * np.sign(place) * b
            done = level < ON_SURFACE
            found[rows[done]] = z[done]
            with np.errstate(divide="ignore", invalid="ignore"):
                z = z - level / slope
            going = np.flatnonzero(~done & (slope > 0) & (z >= low))
            if not len(going):
                break
            rows, z, low = rows[going], z[going], low[going]
            q, e, g = ([a[going] for a in each] for each in (q, e, g))
        return (found + self.centre[k, 2]).reshape(shape)

    def normal(self, k: np.ndarray, point: np.ndarray) -> np.ndarray:
        out = np.einsum("nka,nk->na", self.turn[k], point - self.centre[k]) / self.semi_axes[k]
        g = self.exponents[k]
        along = g * np.abs(out) ** (g - 1) * np.sign(out) / self.semi_axes[k]
        normal: np.ndarray = np.einsum("nka,na->nk", self.turn[k], along)
        return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
