"""The faces of a grid at which a fluid feels a wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

NEAREST_WALL = 0.02
"""Faces nearer to a wall, in cells, count as solid. Forces on nearer ones would hardly be determined, and
iterations would converge several times more slowly."""


@dataclass(frozen=True)
class NoSlip:
    """The no-slip condition on a staggered grid: the force density f on faces, in terms of the velocity u.

        u = 0                                   solid faces next to the fluid
        f = -eta kappa u                        faces of the fluid next to a wall
        kappa = sum (1/theta - 1) / h^2

    The sum is over the neighbours that are solid, in units of the spacing h. The wall is at the part theta of
    the distance to such a neighbour. With this force the second difference between the face and its
    neighbour at rest becomes the one to the wall, which makes the velocity second-order accurate, and the
    equations remain symmetric. f = 0 on all other faces of the fluid. On solid faces farther inside, f
    cancels the driving force, so that the fluid that replaces the body there remains at rest.

    index : flat indices, among all faces of all components, of those with a force; shape (m,).
    compliance : 1/kappa, 0 for solid faces; shape (m,). counts : faces of each component among the m.
    solid : solid faces, shape (3, nx, ny, nz).

    Source: F. Gibou, R. P. Fedkiw, L.-T. Cheng, M. Kang, J. Comput. Phys. 176 (2002) 205, for the second
    difference.
    """

    index: np.ndarray
    compliance: np.ndarray
    counts: tuple[int, int, int]
    solid: np.ndarray

    @classmethod
    def at(cls, distances: Sequence[np.ndarray], spacing: np.ndarray) -> Self:
        """Return the condition for the distances of the faces of each component from the nearest wall.

        distances : three arrays of the shape of the grid. spacing : shape (3,), in the same unit of length.
        """
        solid = np.stack([one <= NEAREST_WALL * spacing.min() for one in distances])
        wet = np.zeros(solid.shape[1:], bool)
        for a in range(3):
            wet |= ~solid[a] | ~np.roll(solid[a], -1, a)
        index, compliance, counts = [], [], []
        for a, distance in enumerate(distances):
            kappa, next_to_fluid = _kappa(distance, solid[a], spacing)
            # Included are the solid faces of a cell with a fluid face, because they close this cell. With
            # their neighbours too, the pressure inside bodies hardly slows down the convergence.
            closing = wet | np.roll(wet, 1, a)
            beside = [np.roll(closing, step, b) for b in range(3) for step in (1, -1)]
            shell = solid[a] & (np.logical_or.reduce([closing, *beside]) | next_to_fluid)
            found = np.flatnonzero(shell | (kappa > 0))
            index.append(found + a * kappa.size)
            counts.append(len(found))
            held = np.where(shell.ravel()[found], np.inf, kappa.ravel()[found])
            compliance.append(1 / held)
        x, y, z = counts
        return cls(np.concatenate(index), np.concatenate(compliance), (x, y, z), solid)

    def inside(self) -> np.ndarray:
        """Return the solid faces that are not in ``index``, shape (3, nx, ny, nz)."""
        inside = self.solid.copy()
        inside.reshape(-1)[self.index] = False
        return inside


def _kappa(distance: np.ndarray, solid: np.ndarray, spacing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return kappa of the fluid faces of a component, and which solid faces have neighbours in the fluid."""
    kappa, next_to_fluid = np.zeros(solid.shape), np.zeros(solid.shape, bool)
    depth = np.where(solid, np.minimum(distance, 0), distance)
    for b in range(3):
        for step in (1, -1):
            beyond, there = np.roll(solid, step, b), np.roll(depth, step, b)
            wall = ~solid & beyond
            theta = depth[wall] / (depth[wall] - there[wall])
            kappa[wall] += (1 / theta - 1) / spacing[b] ** 2
            next_to_fluid |= solid & ~beyond
    return kappa, next_to_fluid
