"""The directions in which a fluid can pass through the pores of a periodic matrix."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def through_paths(solid: np.ndarray) -> np.ndarray:
    """Return the periods along which paths in the fluid lead from a cell to its images, shape (m, 3).

    Each row is the number of periods along x, y and z of one path; all paths are sums of rows. There is none
    if walls enclose all of the fluid.

    solid : whether faces are solid, shape (3, nx, ny, nz); fluid passes from cell to cell through the others.
    """
    shape = solid.shape[1:]
    number = np.arange(np.prod(shape)).reshape(shape)
    inner, across = [], []
    for axis in range(3):
        pairs = np.stack([np.roll(number, 1, axis), number])
        # The first face along an axis leads back to the last cell.
        first = (slice(None),) * (axis + 1) + (slice(0, 1),)
        rest = (slice(None),) * (axis + 1) + (slice(1, None),)
        inner.append(pairs[rest][:, ~solid[axis][rest[1:]]])
        across.append(pairs[first][:, ~solid[axis][first[1:]]])
    rows, columns = np.concatenate(inner, axis=1)
    links = coo_array((np.ones(len(rows), bool), (rows, columns)), shape=(number.size, number.size))
    _, pore = connected_components(links, directed=False)
    neighbours = defaultdict(set)
    for axis, (last, first_cell) in enumerate(across):
        for a, b in np.unique(np.stack([pore[last], pore[first_cell]]), axis=1).T.tolist():
            neighbours[a].add((b, axis, 1))
            neighbours[b].add((a, axis, -1))
    return _periods(neighbours)


def _periods(neighbours: dict[int, set[tuple[int, int, int]]]) -> np.ndarray:
    """Return the periods of all cycles of a graph, each of whose links crosses a face of the box forward (1)
    or backward (-1) along an axis."""
    place: dict[int, np.ndarray] = {}
    found = set()
    for start in list(neighbours):
        if start in place:
            continue
        place[start], pending = np.zeros(3, int), [start]
        while pending:
            pore = pending.pop()
            for other, axis, step in neighbours[pore]:
                there = place[pore] + step * np.eye(3, dtype=int)[axis]
                if other not in place:
                    place[other] = there
                    pending.append(other)
                elif (there != place[other]).any():
                    found.add(tuple((there - place[other]).tolist()))
    return np.array(sorted(found), int).reshape(-1, 3)
