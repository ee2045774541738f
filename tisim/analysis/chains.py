"""Shapes of clusters: length, direction and thickness of chains; and the number of chains side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from tisim.analysis.clusters import labels
from tisim.analysis.separations import Sides, nearest_image


class ClusterShapes(NamedTuple):
    """Shapes of clusters, one row per cluster.

    size : number of particles.
    path : number of particles on the longest of the shortest paths through the cluster.
    extent : range of centres along its first axis (m).
    centre : mean position (m).
    gyration_radii : root mean square distances from the centre along each axis, the largest first (m).
    axes : principal axes of the positions, unit vectors as rows, shape (clusters, 3, 3).
    """

    size: np.ndarray
    path: np.ndarray
    extent: np.ndarray
    centre: np.ndarray
    gyration_radii: np.ndarray
    axes: np.ndarray

    @property
    def direction(self) -> np.ndarray:
        """Return the first axis of each cluster, the direction of a chain, as a unit vector with arbitrary
        sign."""
        return self.axes[:, 0]

    @property
    def thickness(self) -> np.ndarray:
        """Return the root mean square distance of the centres from the first axis, m; 0 for a straight
        chain."""
        return np.hypot(self.gyration_radii[:, 1], self.gyration_radii[:, 2])

    @property
    def breadth(self) -> np.ndarray:
        """Return the mean number of particles side by side: ``size`` over ``path``, 1 for a chain."""
        return self.size / self.path


def cluster_shapes(position: np.ndarray, pairs: np.ndarray, sides: Sides = None) -> ClusterShapes:
    """Return the shapes of the clusters that ``pairs`` (n, 2) form of particles at positions (n, 3), m, in
    the order of ``labels``.

    A cluster that crosses periodic faces is unwrapped first; one that spans the whole box is cut at some
    place. ``path`` is found by two breadth-first searches, from any particle to the farthest one, and from
    there. It is exact for clusters without rings, and otherwise a good lower bound. If a cluster is
    symmetric, such as a single particle, its axes are not unique.

    sides : side lengths of a periodic box, as for ``near``.
    """
    position = np.asarray(position, float)
    number = len(position)
    cluster = labels(number, pairs)
    first = np.unique(cluster, return_index=True)[1]
    order, before, steps = _ways(number, pairs, first)
    # The particle farthest from the first one is an end of the path; the second search starts there.
    ends = order[np.lexsort([steps[order], cluster[order]])][np.cumsum(np.bincount(cluster)) - 1]
    path = np.zeros(len(first), int)
    np.maximum.at(path, cluster, _ways(number, pairs, ends)[2])
    # Place each particle at its image nearest to its predecessor on the path.
    where = position.copy()
    later = order[before[order] < number]
    apart = nearest_image(position[later] - position[before[later]], sides)
    for i, j, step in zip(later.tolist(), before[later].tolist(), apart, strict=True):
        where[i] = where[j] + step
    size = np.bincount(cluster)
    centre = _sums(cluster, where) / size[:, None]
    away = where - centre[cluster]
    moments = _sums(cluster, np.einsum("na,nb->nab", away, away).reshape(-1, 9)).reshape(-1, 3, 3)
    squares, vectors = np.linalg.eigh(moments / size[:, None, None])
    axes = vectors[:, :, ::-1].transpose(0, 2, 1)
    along = np.einsum("na,na->n", away, axes[cluster, 0])
    far, near = np.full(len(size), -np.inf), np.full(len(size), np.inf)
    np.maximum.at(far, cluster, along)
    np.minimum.at(near, cluster, along)
    radii = np.sqrt(np.maximum(squares[:, ::-1], 0.0))
    return ClusterShapes(size, path, far - near, centre, radii, axes)


def orientation_tensor(direction: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return the mean of n (x) n over unit vectors n of shape (n, 3), symmetric with trace 1; shape (3, 3).

    For random directions it is a third of the unit matrix; if all directions are parallel, its largest
    eigenvalue is 1. Without directions, or if all weights are 0, it is NaN.

    weights : weight of each direction, such as the size of its chain, shape (n,); equal by default.

    Source: S. G. Advani, C. L. Tucker, J. Rheol. 31 (1987) 751.
    """
    n = np.asarray(direction, float)
    counts = np.ones(len(n)) if weights is None else np.asarray(weights, float)
    if not counts.sum() > 0:
        return np.full((3, 3), np.nan)
    return np.asarray(np.einsum("n,na,nb->ab", counts / counts.sum(), n, n))


def alignment(
    direction: np.ndarray, axis: tuple[float, float, float], weights: np.ndarray | None = None
) -> float:
    """Return the mean of (3 cos^2 - 1) / 2 over the angles between unit vectors (n, 3) and an axis: 1 if
    parallel, 0 if random, -1/2 if perpendicular, NaN without vectors."""
    e = np.asarray(axis, float) / np.linalg.norm(axis)
    return float((3 * e @ orientation_tensor(direction, weights) @ e - 1) / 2)


def fabric_tensor(position: np.ndarray, pairs: np.ndarray, sides: Sides = None) -> np.ndarray:
    """Return the fabric tensor of contacts, the ``orientation_tensor`` of the branch vectors between the
    centres of ``pairs`` (n, 2); shape (3, 3), NaN without pairs.

    Source: M. Oda, Soils Found. 12 (1972) 17; M. Satake, IUTAM Conf. on Deformation and Failure of Granular
    Materials (1982) 63.
    """
    apart = nearest_image(position[pairs[:, 1]] - position[pairs[:, 0]], sides)
    return orientation_tensor(apart / np.linalg.norm(apart, axis=1, keepdims=True))


def disjoint_chains(pairs: np.ndarray, first: np.ndarray, last: np.ndarray) -> int:
    """Return the largest number of chains of particles side by side: chains that lead over bonds from one set
    of particles to another and do not share a particle.

    pairs : bonds, indices of particles, shape (n, 2).
    first, last : bool, shape (particles,), the sets at which chains begin and end. A particle in both is a
        chain.

    By Menger's theorem this is also the smallest number of particles whose removal separates the sets. It is
    computed as a maximum flow in which each particle has the capacity 1.

    Source: K. Menger, Fund. Math. 10 (1927) 96; L. R. Ford, D. R. Fulkerson, Can. J. Math. 8 (1956) 399.
    """
    first, last = np.asarray(first, bool), np.asarray(last, bool)
    number = len(first)
    i, j = np.asarray(pairs, int).reshape(-1, 2).T
    # Node k is the entrance of particle k, and number + k its exit. All chains begin at one node more, and
    # end at another.
    source, sink, each = 2 * number, 2 * number + 1, np.arange(number)
    begins, ends = np.flatnonzero(first), np.flatnonzero(last)
    rows = (each, number + i, number + j, np.full(len(begins), source), number + ends)
    columns = (number + each, j, i, begins, np.full(len(ends), sink))
    row, column = np.concatenate(rows), np.concatenate(columns)
    capacity = np.ones(len(row), np.int32)
    graph = coo_array((capacity, (row, column)), shape=2 * (2 * number + 2,)).tocsr()
    return int(maximum_flow(graph, source, sink).flow_value)


def _ways(number: int, pairs: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a breadth-first search of all clusters from one start particle in each.

    The three arrays are the particles in the order of the search; the predecessor of each particle
    (``number`` for a start); and the number of particles on its path from the start.
    """
    i, j = np.asarray(pairs).reshape(-1, 2).T
    # An extra root node connected to all starts lets one search cover all clusters.
    rows = np.concatenate([i, np.full(len(starts), number)])
    graph = coo_array((np.ones(len(rows)), (rows, np.concatenate([j, starts]))), shape=2 * (number + 1,))
    order, before = breadth_first_order(graph.tocsr(), number, directed=False)
    order, steps = order[1:], np.zeros(number + 1, int)
    for k, last in zip(order.tolist(), before[order].tolist(), strict=True):
        steps[k] = steps[last] + 1
    return order, before[:number], steps[:number]


def _sums(cluster: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.bincount(cluster, column) for column in values.T])
