"""Shapes of clusters: how long chains are, where they point and how thick they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from tisim.analysis.clusters import labels
from tisim.analysis.separations import Sides, nearest_image


class ClusterShapes(NamedTuple):
    """Cluster shapes are what is known of the shapes of clusters, a row for each by its number.

    size : particles. path : particles along the longest of the shortest ways through it. extent : of centres
    along its first axis (m). centre : mean of positions (m). gyration_radii : root mean squares of
    the distances from the centre along each of its axes, the largest first (m). axes : unit vectors, the
    principal axes of the positions, as rows, shape (clusters, 3, 3).
    """

    size: np.ndarray
    path: np.ndarray
    extent: np.ndarray
    centre: np.ndarray
    gyration_radii: np.ndarray
    axes: np.ndarray

    @property
    def direction(self) -> np.ndarray:
        """Return the first axis of each, the direction of a chain, as a unit vector; either end is its
        head."""
        return self.axes[:, 0]

    @property
    def thickness(self) -> np.ndarray:
        """Return the root mean square distance of the centres from the first axis, m; 0 of a straight
        chain."""
        return np.hypot(self.gyration_radii[:, 1], self.gyration_radii[:, 2])

    @property
    def breadth(self) -> np.ndarray:
        """Return how many particles are side by side in the mean: ``size`` over ``path``, 1 of a chain."""
        return self.size / self.path


def cluster_shapes(position: np.ndarray, pairs: np.ndarray, sides: Sides = None) -> ClusterShapes:
    """Return the shapes of the clusters into which ``pairs`` (n, 2) bind particles at positions (n, 3), m;
    clusters are numbered as by ``labels``.

    A cluster that goes on across joined faces is put together first; one that goes round the whole box is cut
    somewhere. ``path`` is that of two sweeps, from any particle to the farthest, and from there: the longest
    where there are no rings, and else a good lower bound. Axes of a cluster that is alike in some directions,
    such as a single particle, are any of these.

    sides : those of a box that is periodic, as ``near`` takes them.
    """
    position = np.asarray(position, float)
    number = len(position)
    cluster = labels(number, pairs)
    first = np.unique(cluster, return_index=True)[1]
    order, before, steps = _ways(number, pairs, first)
    # Far from the first particle is an end; from there it is as far as the path is long.
    ends = order[np.lexsort([steps[order], cluster[order]])][np.cumsum(np.bincount(cluster)) - 1]
    path = np.zeros(len(first), int)
    np.maximum.at(path, cluster, _ways(number, pairs, ends)[2])
    # Each is put where the image is that the particle before it on the way touches.
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
    """Return the mean of n (x) n over unit vectors n of shape (n, 3), symmetric, of trace 1; shape (3, 3).

    Of directions at random it is a third of the unit matrix; its largest eigenvalue is 1 where all are one.
    Of no directions, or where none counts, it is NaN.
    weights : how much each counts, shape (n,); alike unless given, such as by the size of a chain.

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
    """Return the mean of (3 cos^2 - 1) / 2 of the angles of unit vectors (n, 3) to an axis: 1 along it, 0 at
    random, -1/2 across it, NaN of none."""
    e = np.asarray(axis, float) / np.linalg.norm(axis)
    return float((3 * e @ orientation_tensor(direction, weights) @ e - 1) / 2)


def fabric_tensor(position: np.ndarray, pairs: np.ndarray, sides: Sides = None) -> np.ndarray:
    """Return the fabric tensor of contacts, the ``orientation_tensor`` of the directions from centre to
    centre of ``pairs`` (n, 2), NaN of none; shape (3, 3).

    Source: M. Oda, Soils Found. 12 (1972) 17; M. Satake, IUTAM Conf. on Deformation and Failure of Granular
    Materials (1982) 63.
    """
    apart = nearest_image(position[pairs[:, 1]] - position[pairs[:, 0]], sides)
    return orientation_tensor(apart / np.linalg.norm(apart, axis=1, keepdims=True))


def _ways(number: int, pairs: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the particles as they are come to from one of each cluster, of which there are so many; the one
    before each on the shortest way, ``number`` for those where a way starts, and particles on its way."""
    i, j = np.asarray(pairs).reshape(-1, 2).T
    # A root that is bound to the starts has all clusters searched at once.
    rows = np.concatenate([i, np.full(len(starts), number)])
    graph = coo_array((np.ones(len(rows)), (rows, np.concatenate([j, starts]))), shape=2 * (number + 1,))
    order, before = breadth_first_order(graph.tocsr(), number, directed=False)
    order, steps = order[1:], np.zeros(number + 1, int)
    for k, last in zip(order.tolist(), before[order].tolist(), strict=True):
        steps[k] = steps[last] + 1
    return order, before[:number], steps[:number]


def _sums(cluster: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.bincount(cluster, column) for column in values.T])
