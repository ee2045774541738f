"""Clusters and chains of particles: connected components of the graph of those that are bound."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tisim.analysis.separations import Sides, near, nearest_image


def head_to_tail(
    position: np.ndarray, moment: np.ndarray, diameter: float, share: float = 0.5, sides: Sides = None
) -> np.ndarray:
    """Return the pairs (i < j) of equal spheres of a diameter (m) at positions (n, 3), m, whose dipoles (n,
    3) bind them by ``share`` or more of what two of them bind at contact, head to tail; shape (pairs, 2).

    U_ij / U_contact = (D/d)^3 (3 (e_i.n)(e_j.n) - e_i.e_j) / 2, e the unit vectors of the moments, so that a
    pair is bound by where it lies, whatever the size of the moments. Side by side no pair is.

    sides : those of a box that is periodic, as ``near`` takes them.
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
    """Return the cluster that each of ``number`` particles is in, as ``pairs`` (n, 2) bind them; shape
    (number,).

    Numbered from 0; a particle that is bound to none is a cluster of its own.
    """
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(number, number))
    return np.asarray(connected_components(graph, directed=False)[1])


def mean_size(number: int, pairs: np.ndarray) -> float:
    """Return the mean number of particles per cluster, singles included: 1 where nothing is bound."""
    return float(number / (labels(number, pairs).max() + 1))


def fraction_in_clusters(cluster: np.ndarray, least: int) -> float:
    """Return the fraction of particles that are in clusters of ``least`` or more, given the ``labels`` of
    their clusters; NaN of none."""
    sizes = np.bincount(cluster)
    return float(sizes[sizes >= least].sum() / sizes.sum()) if len(cluster) else float("nan")
