"""A grid of cells for finding triangles near a point, and a lower bound of their distance elsewhere.

A small triangle is listed in all cells that its bounding box overlaps. For a large one, such as a facet
across an inclined sheet, this would be most of the grid. It is therefore listed only in the cells that it
intersects, which are found by bisection of its bounding box.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

CELLS = 2**20
"""Largest number of cells of a grid."""
MOST_LISTED = 2**22
"""Largest number of entries in all cell lists: 34 MB, and indices that are exact in single precision."""
WIDTH = 1.5
"""Width of a cell relative to the mean width of the triangles."""
LARGE_SPAN = 64
"""A triangle is large if its bounding box overlaps more cells than this."""
CELL_MARGIN = 1e-6
"""Relative enlargement of cells, to allow for rounding of positions."""


@dataclass(frozen=True)
class TriangleGrid:
    """A grid that lists for each cell the triangles that may intersect it.

    low : corner of the grid, m.
    width : width of a cell, m.
    dims : number of cells along each axis.
    first : first cell of each triangle along each axis, shape (triangles, 3); -1 for large triangles.
    begin : start of the list of each cell in ``members``, followed by the end of the last list.
    clear : lower bound of the distance (m) from any point of a cell to all triangles.
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
        reach = (corners.max(axis=1) - corners.min(axis=1)).max(axis=1)
        # A triangle that spans a number of cells intersects at least this number.
        width = max(width, float(reach.sum()) / CELLS)
        while np.prod((high - low) / width + 1) > CELLS:
            width *= 2 ** (1 / 3)
        while (listed := _Listing(corners, low, high, width).pairs()) is None:
            width *= 2
        cells, members, first, dims = listed
        order = np.argsort(cells, kind="stable")
        counts = np.bincount(cells, minlength=int(np.prod(dims)))
        # Two points in cells are nearer than the cell centres by at most a diagonal.
        apart = distance_transform_edt(counts.reshape(dims) == 0)
        clear = width * np.maximum(apart - np.sqrt(3.0), 0.0).ravel()
        begin = np.concatenate([[0], np.cumsum(counts)])
        return cls(low, width, dims, first, begin, members[order], clear)


class _Listing:
    """Finds the cells of each triangle in a grid with a cell width (m)."""

    def __init__(self, corners: np.ndarray, low: np.ndarray, high: np.ndarray, width: float) -> None:
        self.corners, self.low, self.width = corners, low, width
        self.dims = ((high - low) / width).astype(int) + 1
        self.first, self.last = (
            np.minimum(((ends - low) / width).astype(int), self.dims - 1)
            for ends in (corners.min(axis=1), corners.max(axis=1))
        )

    def pairs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
        """Return cell and triangle index of each intersecting pair, the first cells of triangles, and the
        number of cells along each axis; None if there are too many pairs."""
        number = (self.last - self.first + 1).prod(axis=1)
        large = number > LARGE_SPAN
        found, total = [], int(number[~large].sum())
        if total > MOST_LISTED:
            return None
        small = np.flatnonzero(~large)
        found.append(self._in_boxes(small))
        for cells, triangle in self._by_halves(np.flatnonzero(large)):
            total += len(cells)
            if total > MOST_LISTED:
                return None
            found.append((cells, triangle))
        cells, members = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return cells, members, np.where(large[:, None], -1, self.first), self.dims

    def _index(self, at: np.ndarray) -> np.ndarray:
        index: np.ndarray = (at[:, 0] * self.dims[1] + at[:, 1]) * self.dims[2] + at[:, 2]
        return index

    def _in_boxes(self, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the pairs of some triangles with all cells that their bounding boxes overlap."""
        spans = self.last[which] - self.first[which] + 1
        number = spans.prod(axis=1)
        row = np.repeat(np.arange(len(which)), number)
        place = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
        rest, z = np.divmod(place, spans[row, 2])
        x, y = np.divmod(rest, spans[row, 1])
        return self._index(self.first[which[row]] + np.stack([x, y, z], axis=1)), which[row]

    def _by_halves(self, which: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield the pairs of some triangles with the cells that they intersect. Blocks of cells are bisected,
        and blocks that a triangle does not intersect are discarded."""
        self.axes, self.number = self._parting(which), np.zeros(len(self.corners), int)
        self.number[which] = np.arange(len(which))
        waiting = [(which, self.first[which], self.last[which])] if len(which) else []
        while waiting:
            triangle, first, last = waiting.pop()
            half = len(triangle) // 2
            if half >= MOST_LISTED // 32:
                # Split into parts and process the last one first, to limit the memory of pending blocks.
                parts = (slice(None, half), slice(half, None))
                waiting += [(triangle[part], first[part], last[part]) for part in parts]
                continue
            meets = self._meet(triangle, first, last)
            triangle, first, last = triangle[meets], first[meets], last[meets]
            whole = (first == last).all(axis=1)
            yield self._index(first[whole]), triangle[whole]
            triangle, first, last = triangle[~whole], first[~whole], last[~whole]
            if len(triangle):
                rows, axis = np.arange(len(triangle)), (last - first).argmax(axis=1)
                middle, upper, lower = (first + last)[rows, axis] // 2, first.copy(), last.copy()
                lower[rows, axis], upper[rows, axis] = middle, middle + 1
                blocks = (np.concatenate([first, upper]), np.concatenate([lower, last]))
                waiting.append((np.concatenate([triangle, triangle]), *blocks))

    def _meet(self, triangle: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return which triangles intersect blocks of cells, by the separating axis test.

        Source: T. Akenine-Moeller, J. Graphics Tools 6 (2001) 29.
        """
        half = 0.5 * self.width * (1.0 + CELL_MARGIN) * (last - first + 1)
        centre = self.low + 0.5 * self.width * (first + last + 1)
        number, meets = self.number[triangle], np.arange(len(triangle))
        for axis, least, most in self.axes:
            which = number[meets]
            along, size = axis[which], (np.abs(axis[which]) * half[meets]).sum(axis=1)
            place = (along * centre[meets]).sum(axis=1)
            meets = meets[(least[which] <= place + size) & (most[which] >= place - size)]
        return meets

    def _parting(self, which: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Return the possible separating axes of some triangles and blocks along x, y and z, each with the
        range of the triangles along it."""
        corners = self.corners[which]
        sides = np.roll(corners, -1, axis=1) - corners
        axes = [np.cross(sides[:, 0], sides[:, 1])]
        axes += [np.cross(sides[:, k], along) for k in range(3) for along in np.eye(3)]
        axes += [np.broadcast_to(along, axes[0].shape) for along in np.eye(3)]
        places = [np.einsum("na,nca->nc", axis, corners) for axis in axes]
        return [(axis, p.min(axis=1), p.max(axis=1)) for axis, p in zip(axes, places, strict=True)]
