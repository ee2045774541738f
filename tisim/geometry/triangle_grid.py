"""Cells in which triangles near a place are found, and how far away they are elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

CELLS = 2**20
"""A grid has at most so many cells."""
WIDTH = 1.5
"""A cell is so many times as wide as the triangles are in the mean."""


@dataclass(frozen=True)
class TriangleGrid:
    """A triangle grid lists with each cell the triangles whose boxes reach into it.

    low : corner of the grid, m. width : of a cell, m. dims : cells along each axis. first : the first cell of
    each triangle along each axis, shape (triangles, 3). begin : where the list of each cell begins in
    ``members``, with the end of the last. clear : how far (m) each place of a cell is from all triangles at
    least.
    """

    low: np.ndarray
    width: float
    dims: np.ndarray
    first: np.ndarray
    begin: np.ndarray
    members: np.ndarray
    clear: np.ndarray

    @classmethod
    def of(cls, corners: np.ndarray) -> TriangleGrid:
        """Return the grid of triangles, ``corners`` (m) of shape (triangles, 3, 3)."""
        sides = corners[:, 1:] - corners[:, :1]
        area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        width = WIDTH * float(np.sqrt(area / len(corners)))
        while np.prod((high - low) / width + 1) > CELLS:
            width *= 2 ** (1 / 3)
        dims = ((high - low) / width).astype(int) + 1
        first, last = (
            np.minimum(((ends - low) / width).astype(int), dims - 1)
            for ends in (corners.min(axis=1), corners.max(axis=1))
        )
        cells, members = _listed(first, last, dims)
        order = np.argsort(cells, kind="stable")
        counts = np.bincount(cells, minlength=int(np.prod(dims)))
        # Two places in cells whose centres are so far apart are nearer by a diagonal at most.
        apart = distance_transform_edt(counts.reshape(dims) == 0)
        clear = width * np.maximum(apart - np.sqrt(3.0), 0.0).ravel()
        begin = np.concatenate([[0], np.cumsum(counts)])
        return cls(low, width, dims, first, begin, members[order], clear)


def _listed(first: np.ndarray, last: np.ndarray, dims: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return cell and triangle of each pair of the two that meet."""
    spans = last - first + 1
    number = spans.prod(axis=1)
    triangle = np.repeat(np.arange(len(first)), number)
    place = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
    span = spans[triangle]
    rest, z = np.divmod(place, span[:, 2])
    x, y = np.divmod(rest, span[:, 1])
    at = first[triangle] + np.stack([x, y, z], axis=1)
    return (at[:, 0] * dims[1] + at[:, 1]) * dims[2] + at[:, 2], triangle
