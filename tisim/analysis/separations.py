"""Pairs of nearby particles, also across the faces of a periodic box."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tisim.domains.domain import Domain
from tisim.errors import must

Sides = Sequence[float] | np.ndarray | None
"""Sides of a periodic box: lengths in m along x, y and z, 0 along non-periodic axes; or the vectors returned
by ``periodic_sides``; None in open space."""


def periodic_sides(domain: Domain, time: float = 0.0) -> np.ndarray:
    """Return the vectors (m) from a particle to its images in a domain at a time (s), one row per axis, 0 for
    non-periodic axes; shape (3, 3). In a sheared box one vector is tilted."""
    return np.asarray(domain.edges(time) * np.array(domain.imaged())[:, None])


def vectors_of(sides: Sides) -> np.ndarray:
    """Return sides as vectors, one row per axis, shape (3, 3)."""
    given = np.zeros(3) if sides is None else np.asarray(sides, float)
    vectors = np.diag(given) if given.shape == (3,) else given
    must(vectors.shape == (3, 3), "sides", "three lengths, or three vectors", given.shape)
    must(bool((np.diag(vectors) >= 0).all()), "sides", "0 or above", given)
    leaning = [axis for axis in range(3) if np.count_nonzero(vectors[axis]) > 1]
    must(len(leaning) < 2, "sides", "vectors with at most one tilted, as in a sheared box", given)
    return vectors


def nearest_image(apart: np.ndarray, sides: Sides) -> np.ndarray:
    """Return the shortest periodic images of separation vectors ``apart`` (m), shape (n, 3)."""
    return _shifted(np.asarray(apart, float), vectors_of(sides), np.rint)


def near(position: np.ndarray, reach: ArrayLike, sides: Sides = None) -> np.ndarray:
    """Return the pairs (i < j) of positions (n, 3), m, at most ``reach`` (m) apart, sorted; shape (pairs, 2).

    reach : one distance for all pairs; or shape (n,), and the distance of a pair is the sum of both. In a
        periodic box the nearest image counts.
    """
    position = np.asarray(position, float)
    half = np.broadcast_to(np.asarray(reach, float), len(position)) / (1 if np.ndim(reach) else 2)
    if not len(position) or half.max() <= 0:
        return np.empty((0, 2), np.intp)
    places, number = with_images(position, 2 * half.max(), sides)
    # Particles of similar reach share a tree. Otherwise a single large grain among many small ones would
    # require a search of all pairs of small grains within its reach.
    rank = np.frexp(half.max() / np.maximum(half, np.finfo(float).tiny))[1][number]
    kinds = [np.flatnonzero(rank == one) for one in np.unique(rank)]
    trees, found = [cKDTree(places[kind]) for kind in kinds], []
    for a, (kind, tree) in enumerate(zip(kinds, trees, strict=True)):
        widest = half[number[kind]].max()
        found.append(number[kind[tree.query_pairs(2 * widest, output_type="ndarray").reshape(-1, 2)]])
        for smaller, beside in zip(kinds[a + 1 :], trees[a + 1 :], strict=True):
            within = widest + half[number[smaller]].max()
            pairs = tree.sparse_distance_matrix(beside, within, output_type="ndarray")
            found.append(np.column_stack([number[kind[pairs["i"]]], number[smaller[pairs["j"]]]]))
    i, j = np.sort(np.vstack(found), axis=1).T
    # Pairs across a face are found from both sides; a unique index per pair removes duplicates and sorts
    # them.
    i, j = np.divmod(np.unique(i * len(position) + j), len(position))
    apart = np.linalg.norm(nearest_image(position[j] - position[i], sides), axis=1)
    kept = (i != j) & (apart <= half[i] + half[j])
    return np.column_stack([i[kept], j[kept]])


def with_images(position: np.ndarray, reach: float, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (m) inside the periodic box, followed by their images at most ``reach`` (m) outside;
    and the particle index of each."""
    vectors = vectors_of(sides)
    places, number = _shifted(position, vectors, np.floor), np.arange(len(position))
    for axis in _leaning_first(vectors):
        side = vectors[axis, axis]
        must(reach <= side, "reach", f"at most a side of the periodic box, {side:g} m", reach)
        along = places[:, axis]
        low, high = np.flatnonzero(along <= reach), np.flatnonzero(along >= side - reach)
        images = np.vstack([places[low] + vectors[axis], places[high] - vectors[axis]])
        # Images shifted along other axes too are wrapped there, and get their own images along those axes
        # next.
        others = vectors.copy()
        others[axis] = 0.0
        images = _shifted(images, others, np.floor) if np.count_nonzero(vectors[axis]) > 1 else images
        places, number = np.vstack([places, images]), np.concatenate([number, number[low], number[high]])
    return places, number


def _leaning_first(vectors: np.ndarray) -> list[int]:
    """Return the periodic axes; an axis along which images move past the box comes first."""
    axes = [axis for axis in range(3) if vectors[axis, axis] > 0]
    return sorted(axes, key=lambda axis: -np.count_nonzero(vectors[axis]))


def _shifted(points: np.ndarray, vectors: np.ndarray, rounding: np.ufunc) -> np.ndarray:
    """Return points shifted back along each axis by the number of sides that ``rounding`` gives."""
    for axis in _leaning_first(vectors):
        points = points - rounding(points[:, axis] / vectors[axis, axis])[:, None] * vectors[axis]
    return points
