"""Gaps between the surfaces of all near pairs of a packing, by the narrow phase of the engine."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.shapes.gaps import gaps


class Gaps(NamedTuple):
    """Near pairs of bodies.

    pairs : indices (i <= j) of the bodies, shape (m, 2). A pair that is near across several faces of a narrow
    box is there as often, and a body may be near to an image of its own.
    gap : distance of the surfaces, m, negative if they overlap, shape (m,).
    normal : unit normal of the contact, from i to j, shape (m, 3).
    separation : centre of j minus centre of i, m, shape (m, 3).
    """

    pairs: np.ndarray
    gap: np.ndarray
    normal: np.ndarray
    separation: np.ndarray


def near_gaps(packing: PackedBodies, reach: float) -> Gaps:
    """Return all pairs of bodies with a gap between surfaces of at most ``reach`` (m), across periodic faces
    too.

    Pairs whose bounding spheres are that near are found by a k-d tree, and their gaps by the kernels of the
    engine: in closed form for spheres and rods, by Newton's method if one of them is a superquadric.
    """
    i, j, separation = _candidates(packing, reach)
    pairs, bodies = np.column_stack([i, j]), (packing.shape, packing.scale, packing.orientation)
    gap, normal = gaps(packing.shapes, *bodies, pairs, separation, reach)
    near = gap <= reach
    return Gaps(pairs[near], gap[near], normal[near], separation[near])


def relative_gaps(packing: PackedBodies, near: Gaps) -> np.ndarray:
    """Return gaps over D of the smaller body of each pair, shape (m,)."""
    return np.asarray(near.gap / packing.diameters()[near.pairs].min(axis=1))


def _candidates(packing: PackedBodies, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the bodies i <= j of the pairs whose bounding spheres are at most ``reach`` (m) apart, and their
    separations (m)."""
    number, half = len(packing), packing.bounding_radii() + reach / 2
    if not number or half.max() <= 0:
        return np.zeros(0, int), np.zeros(0, int), np.zeros((0, 3))
    widest = 2 * float(half.max())
    places, index = packing.images(widest)
    near = cKDTree(places[:number]).sparse_distance_matrix(cKDTree(places), widest, output_type="ndarray")
    i, other = near["i"], near["j"]
    j, separation = index[other], places[other] - places[i]
    # Of the two images of a pair, one is kept: j is the later body, or an image of i further up.
    upward = np.where(separation[:, 0] != 0, separation[:, 0], separation[:, 1])
    upward = np.where(upward != 0, upward, separation[:, 2])
    once = (i < j) | ((i == j) & (upward > 0))
    kept = once & (near["v"] <= half[i] + half[j])
    order = np.lexsort([separation[kept][:, k] for k in (2, 1, 0)] + [j[kept], i[kept]])
    return i[kept][order], j[kept][order], separation[kept][order]
