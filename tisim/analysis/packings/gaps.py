"""Gaps between the surfaces of all near pairs of a packing, by the narrow phase of the engine."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.errors import must
from tisim.numerics.vectors import rotated
from tisim.shapes.rod_pairs import closest_rods
from tisim.shapes.superquadric_pairs import closest_superquadrics


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
    engine: in closed form for spheres and rods, by Newton's method for superquadrics. All shapes of a packing
    must be rods or spheres, or all superquadrics, ellipsoids or spheres.
    """
    i, j, separation = _candidates(packing, reach)
    found = _closest(packing, i, j, separation, reach)
    near = found[:, 0] <= reach
    pairs = np.column_stack([i, j])[near]
    return Gaps(pairs, found[near, 0], found[near, 1:], separation[near])


def relative_gaps(packing: PackedBodies, gaps: Gaps) -> np.ndarray:
    """Return gaps over D of the smaller body of each pair, shape (m,)."""
    return np.asarray(gaps.gap / packing.diameters()[gaps.pairs].min(axis=1))


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


def _closest(
    packing: PackedBodies, i: np.ndarray, j: np.ndarray, separation: np.ndarray, reach: float
) -> np.ndarray:
    """Return gap (m) and normal of each pair, shape (m, 4)."""
    out = np.zeros((len(i), 4))
    rods = [one.rod() for one in packing.shapes]
    superquadrics = [one.superquadric() for one in packing.shapes]
    kinds = ", ".join(sorted({type(one).__name__ for one in packing.shapes}))
    known = None not in rods or None not in superquadrics
    must(known, "shapes", "all rods or spheres, or all superquadrics, ellipsoids or spheres", kinds)
    if not len(i):
        return out
    first, second = i.astype(np.int32), j.astype(np.int32)
    where = (np.ascontiguousarray(separation), first, second, np.ascontiguousarray(packing.orientation))
    runtime.current()
    if None not in rods:
        sizes = np.array([one for one in rods if one], float).reshape(-1, 2)
        _rods(*where, sizes[packing.shape] * packing.scale[:, None], out)
        return out
    axes, exponents = (np.array([one[k] for one in superquadrics if one]) for k in (0, 1))
    sizes, powers = axes[packing.shape] * packing.scale[:, None], exponents[packing.shape]
    _superquadrics(bool((exponents == 2).all()), *where, sizes, powers, float(reach), out)
    return out


@ti.func
def _row(array: ti.template(), m, size: ti.template()):  # type: ignore[valid-type]
    """Return a row of an array as a vector in f64."""
    return ti.Vector([ti.cast(array[m, k], ti.f64) for k in ti.static(range(size))])


@ti.func
def _write(out: ti.template(), m, gap, normal):  # type: ignore[valid-type]
    out[m, 0] = gap
    for k in ti.static(range(3)):
        out[m, 1 + k] = normal[k]


@in_taichi_thread
@ti.kernel
def _rods(
    separation: ti.types.ndarray(),  # type: ignore[valid-type]
    first: ti.types.ndarray(),  # type: ignore[valid-type]
    second: ti.types.ndarray(),  # type: ignore[valid-type]
    q: ti.types.ndarray(),  # type: ignore[valid-type]
    rod: ti.types.ndarray(),  # type: ignore[valid-type]
    out: ti.types.ndarray(),  # type: ignore[valid-type]
):
    for m in range(first.shape[0]):
        i, j, c = first[m], second[m], _row(separation, m, 3)
        along = 0.0 * c
        along[2] += 1.0
        axis_i, axis_j = rotated(_row(q, i, 4), along), rotated(_row(q, j, 4), along)
        sizes_i, sizes_j = _row(rod, i, 2), _row(rod, j, 2)
        gap, normal, _x, _y = closest_rods(c, axis_i, sizes_i[0], sizes_i[1], axis_j, sizes_j[0], sizes_j[1])
        _write(out, m, gap, normal)


@in_taichi_thread
@ti.kernel
def _superquadrics(
    ellipsoids: ti.template(),  # type: ignore[valid-type]
    separation: ti.types.ndarray(),  # type: ignore[valid-type]
    first: ti.types.ndarray(),  # type: ignore[valid-type]
    second: ti.types.ndarray(),  # type: ignore[valid-type]
    q: ti.types.ndarray(),  # type: ignore[valid-type]
    axes: ti.types.ndarray(),  # type: ignore[valid-type]
    exponents: ti.types.ndarray(),  # type: ignore[valid-type]
    far: ti.f64,
    out: ti.types.ndarray(),  # type: ignore[valid-type]
):
    for m in range(first.shape[0]):
        i, j = first[m], second[m]
        here = _row(q, i, 4), _row(axes, i, 3), _row(exponents, i, 3)
        there = _row(q, j, 4), _row(axes, j, 3), _row(exponents, j, 3)
        gap, normal, _x, _y = closest_superquadrics(
            ellipsoids, _row(separation, m, 3), here[0], here[1], here[2], there[0], there[1], there[2], far
        )
        _write(out, m, gap, normal)
