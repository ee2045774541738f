"""Clusters and chains of particles: connected components of the graph of bonds."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tisim.analysis.separations import Sides, near, nearest_image


def head_to_tail(
    position: np.ndarray, moment: np.ndarray, diameter: float, share: float = 0.5, sides: Sides = None
) -> np.ndarray:
    """Return the pairs (i < j) of equal dipolar spheres that are bound head to tail; shape (pairs, 2).

        U_ij / U_contact = (D/d)^3 (3 (e_i.n)(e_j.n) - e_i.e_j) / 2

    A pair is bound if this ratio, of its dipole energy to that of two spheres head to tail in contact, is at
    least ``share``. e are unit vectors of the moments, so only positions and directions matter, and not the
    magnitude of the moments. Spheres side by side are never bound.

    position : m, shape (n, 3). moment : shape (n, 3). diameter : m.
    sides : side lengths of a periodic box, as for ``near``.
    """
    pairs = near(position, diameter * share ** (-1 / 3), sides)
    i, j = pairs.T
    e = moment / np.linalg.norm(moment, axis=1, keepdims=True)
    away = nearest_image(position[j] - position[i], sides)
    distance = np.linalg.norm(away, axis=1)
    n = away / distance[:, None]
    angular = 3 * (e[i] * n).sum(axis=1) * (e[j] * n).sum(axis=1) - (e[i] * e[j]).sum(axis=1)
    return pairs[0.5 * (diameter / distance) ** 3 * angular >= share]


def labels(number: int, pairs: np.ndarray) -> np.ndarray:
    """Return the index of the cluster of each of ``number`` particles, given bonds ``pairs`` (n, 2); shape
    (number,).

    Clusters are numbered from 0; a particle without bonds is a cluster.
    """
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(number, number))
    return np.asarray(connected_components(graph, directed=False)[1])


def mean_size(number: int, pairs: np.ndarray) -> float:
    """Return the mean number of particles per cluster, including single particles: 1 without bonds."""
    return float(number / (labels(number, pairs).max() + 1))


def fraction_in_clusters(cluster: np.ndarray, least: int) -> float:
    """Return the fraction of particles in clusters of at least ``least`` particles, given the ``labels`` of
    clusters; NaN without particles."""
    sizes = np.bincount(cluster)
    return float(sizes[sizes >= least].sum() / sizes.sum()) if len(cluster) else float("nan")
