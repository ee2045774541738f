"""The demagnetising tensors between cylinders: the mean field of each in the volume of each.

Cylinder j with the uniform magnetisation M_j has the mean field -N_ij M_j in cylinder i. With volumes V,
V_i N_ij = V_j N_ji^T, because both sides give the energy of the pair, so only one of the two is computed.
"""

from collections.abc import Sequence

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.packing.random_bodies import segment_distances
from tisim.sources.magnetic import cylinder_field, cylinder_rows
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.cylinder_end import ClosedEnds
from tisim.sources.magnetic.cylinder_frame import relative_place
from tisim.sources.magnetic.stoner_wohlfarth import demagnetising_factor

AXIAL_POINTS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Numbers of points along the axis of a cylinder over which a field is averaged."""
RINGS = (1, 2, 3, 4)
"""Numbers of rings of points across a cylinder; n rings have 4 n points each."""


@in_taichi_thread
@ti.kernel
def _means(
    ends: ti.template(),  # type: ignore[valid-type]
    rows: ti.types.ndarray(),  # type: ignore[valid-type]
    pairs: ti.types.ndarray(),  # type: ignore[valid-type]
    nodes: ti.types.ndarray(),  # type: ignore[valid-type]
    out: ti.types.ndarray(),  # type: ignore[valid-type]
):
    """Average W_ij of cylinder j over nodes in cylinder i, given in units of its radius and half length."""
    for e in range(pairs.shape[0]):
        i, j = pairs[e, 0], pairs[e, 1]
        here, lead_here, rest_here, size, length = cylinder_rows.placed(rows, i)
        centre, lead, rest, radius, half = cylinder_rows.placed(rows, j)
        up, aside = lead_here + rest_here, ti.Vector([0.0, 0.0, 1.0])
        if ti.abs(up[2]) > 0.7:
            aside = ti.Vector([1.0, 0.0, 0.0])
        first = up.cross(aside).normalized()
        second, mean = up.cross(first), ti.Matrix.zero(float, 3, 3)
        for q in range(nodes.shape[0]):
            r = here + length * nodes[q, 2] * up + size * (nodes[q, 0] * first + nodes[q, 1] * second)
            rho, outward, z, end = relative_place(r, centre, lead, rest, half)
            six = cylinder_field.shape(rho, z, end, radius, half, ends)
            mean += nodes[q, 3] * cylinder_field.tensor(six, rho, outward, lead + rest)
        for a, b in ti.static(ti.ndrange(3, 3)):
            out[e, 3 * a + b] = mean[a, b]


def _nodes(along: int, rings: int) -> np.ndarray:
    """Return points in a cylinder of radius 1 and half length 1, and their weights, (n, 4): Gauss's along the
    axis and in the square of the distance from it, evenly about it."""
    z, of_z = np.polynomial.legendre.leggauss(along)
    square, of_square = np.polynomial.legendre.leggauss(rings)
    angle = 2 * np.pi * (np.arange(4 * rings) + 0.5) / (4 * rings)
    rho = np.sqrt(0.5 + 0.5 * square)
    shape = along, rings, 4 * rings
    columns = (
        rho[:, None] * np.cos(angle),
        rho[:, None] * np.sin(angle),
        z[:, None, None],
        0.25 * of_z[:, None, None] * of_square[:, None] / (4 * rings),
    )
    return np.stack([np.broadcast_to(one, shape) for one in columns], axis=-1).reshape(-1, 4)


def _coaxial(radius: float, length: float, pieces: int) -> np.ndarray:
    """Return N along the axis between equal pieces of a cylinder, by the number of pieces between their
    centres, (pieces,).

    The energy of n pieces that are magnetised along the axis is the energy of a cylinder of n lengths, so the
    energy of two is half the second difference of l N(l).
    """
    whole = np.array([0.0, *(n * demagnetising_factor(radius, n * length) for n in range(1, pieces + 1))])
    return np.array([whole[1], *(0.5 * np.diff(whole, 2))])


def demagnetising_tensors(cylinders: Sequence[Cylinder], pieces: int = 1) -> np.ndarray:
    """Return N_ij, shape (n, 3, n, 3), without unit, of n cylinders.

    pieces : number of consecutive cylinders that are equal parts of one.
    The pairs of one cylinder are exact. Other pairs are averaged by quadrature, with more points for closer
    pairs; the largest error of a component, for cylinders that touch, is about 1e-4.
    """
    n = len(cylinders)
    centre, axis = np.array([c.centre for c in cylinders]), np.array([c.direction for c in cylinders])
    radius = np.array([c.radius for c in cylinders])
    half = 0.5 * np.array([c.length for c in cylinders])
    tensors = np.zeros((n, n, 3, 3))
    for first in range(0, n, pieces):
        one, outer = cylinders[first], np.multiply.outer(axis[first], axis[first])
        factors = _coaxial(one.radius, one.length, pieces)
        apart = np.abs(np.subtract.outer(np.arange(pieces), np.arange(pieces)))
        alone = (apart == 0).astype(float)
        along, across = factors[apart], 0.5 * (alone - factors[apart])
        own = slice(first, first + pieces)
        tensors[own, own] = along[..., None, None] * outer + across[..., None, None] * (np.eye(3) - outer)
    i, j = np.triu_indices(n, 1)
    other = i // pieces != j // pieces
    i, j = i[other], j[other]
    # The shorter one of a pair needs fewer points.
    swap = half[i] > half[j]
    i, j = np.where(swap, j, i), np.where(swap, i, j)
    gap = np.empty((n, n))
    for k in range(n):
        gap[k] = segment_distances(centre - centre[k], axis[k], axis, float(half[k]), half)
    apart = np.maximum(gap[i, j], 0.7 * (radius[i] + radius[j]))
    along = np.searchsorted(AXIAL_POINTS, np.minimum(2 + 4.0 * half[i] / apart, AXIAL_POINTS[-1]))
    rings = np.digitize(radius[i] / apart, (0.05, 0.12, 0.3))
    volume = radius**2 * half
    found = _averages(cylinders, np.stack([i, j], axis=1), along, rings)
    tensors[i, j] = -found
    tensors[j, i] = -np.swapaxes(found, 1, 2) * (volume[i] / volume[j])[:, None, None]
    return tensors.transpose(0, 2, 1, 3)


def _averages(
    cylinders: Sequence[Cylinder], pairs: np.ndarray, along: np.ndarray, rings: np.ndarray
) -> np.ndarray:
    """Return the mean W of the second cylinder of each pair in the first, (pairs, 3, 3)."""
    real = np.float64 if runtime.current().real == ti.f64 else np.float32
    rows, ends, out = cylinder_rows.rows(cylinders), ClosedEnds(), np.zeros((len(pairs), 9), real)
    kind = along * len(RINGS) + rings
    for one in np.unique(kind):
        chosen = np.flatnonzero(kind == one)
        part = np.zeros((len(chosen), 9), real)
        nodes = _nodes(AXIAL_POINTS[one // len(RINGS)], RINGS[one % len(RINGS)]).astype(real)
        _means(ends, rows, np.ascontiguousarray(pairs[chosen], np.int32), nodes, part)
        out[chosen] = part
    return out.reshape(-1, 3, 3).astype(float)
