"""Local expansions of the field of distant cylinders, in the cells of an octree.

A cylinder is distant from a cell if a harmonic polynomial of the given degree represents its field and the
gradient there to the tolerance. The polynomial of a cell is the sum over all cylinders that are distant from
the cell or from a larger cell around it. The others are near; they are tried again in the eight parts of the
cell, until few are near or the tree is full.

In a cell with centre c and half side h, the potential is h sum_k a_k R_k((r - c)/h) with the regular solid
harmonics R_k, and B is its gradient.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics import solid_harmonics
from tisim.sources.magnetic import cylinder_field, cylinder_rows
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.cylinder_end import ClosedEnds
from tisim.sources.magnetic.cylinder_frame import relative_place

FACE_POINTS, NODES_TOGETHER = 2, 8
"""Points along each side of the face of a cell at which fields are represented, and points evaluated
together."""
GRADIENT_ELEMENTS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2))
"""The independent elements of the gradient, a symmetric and traceless matrix."""
OCTANTS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""Centres of the parts of a cell, in the order x, y, z."""
LEAST_GAP = 2.0
"""Smallest distance of a distant cylinder from the centre of a cell, in half sides. No point of the cell is
farther than sqrt(3) from the centre, so all cylinders within 2 - sqrt(3) half sides of any of its points are
near, also those without a field."""
CELL_PAIRS_AT_ONCE = 20_000
"""Number of pairs of a cell and a cylinder that are processed together."""
SLACK = 0.8
"""Cylinders are tried if they are farther than this part of the smallest distance of a distant one so far."""


@in_taichi_thread
@ti.kernel
def _fields(
    ends: ti.template(),  # type: ignore[valid-type]
    rows: ti.types.ndarray(),  # type: ignore[valid-type]
    cells: ti.types.ndarray(),  # type: ignore[valid-type]
    pairs: ti.types.ndarray(),  # type: ignore[valid-type]
    nodes: ti.types.ndarray(),  # type: ignore[valid-type]
    out: ti.types.ndarray(),  # type: ignore[valid-type]
):
    """Compute B (T) and h times its gradient of each pair, at the nodes of a cell; cells: centres and h."""
    for e in range(pairs.shape[0]):
        c, k = pairs[e, 0], pairs[e, 1]
        place = ti.Vector([cells[c, a] for a in ti.static(range(3))])
        size = cells[c, 3]
        centre, lead, rest, radius, half = cylinder_rows.placed(rows, k)
        across, along = cylinder_rows.vector(rows, k, "across"), cylinder_rows.number(rows, k, "along")
        for first in range(nodes.shape[1] // NODES_TOGETHER):
            # First without branches, so that compilers vectorise; then the nodes for which this is invalid.
            # All numbers are read before and written afterwards for the same reason.
            x = [ti.Vector([0.0 * size] * NODES_TOGETHER) for _ in ti.static(range(3))]
            found = [ti.Vector([0.0 * size] * NODES_TOGETHER) for _ in ti.static(range(8))]
            left, wrong = ti.Vector([0] * NODES_TOGETHER, ti.i32), 0
            for lane in range(NODES_TOGETHER):
                for a in ti.static(range(3)):
                    x[a][lane] = place[a] + size * nodes[a, first * NODES_TOGETHER + lane]
            for lane in range(NODES_TOGETHER):
                r = ti.Vector([x[0][lane], x[1][lane], x[2][lane]])
                rho, outward, z, end = relative_place(r, centre, lead, rest, half)
                six, right = cylinder_field.mostly(rho, z, end, radius, half, ends)
                _put(found, lane, six, rho, outward, lead + rest, across, along)
                left[lane] = ti.select(right, 0, 1)
                wrong += left[lane]
            if wrong > 0:
                for lane in range(NODES_TOGETHER):
                    if left[lane] > 0:
                        r = ti.Vector([x[0][lane], x[1][lane], x[2][lane]])
                        rho, outward, z, end = relative_place(r, centre, lead, rest, half)
                        six = cylinder_field.shape(rho, z, end, radius, half, ends)
                        _put(found, lane, six, rho, outward, lead + rest, across, along)
            for lane in range(NODES_TOGETHER):
                for a in ti.static(range(8)):
                    scale = mu_0 if a < 3 else mu_0 * size
                    out[e, a, first * NODES_TOGETHER + lane] = scale * found[a][lane]


@ti.func
def _put(found: ti.template(), lane, six, rho, outward, axis, across, along):  # type: ignore[valid-type]
    """Set H (A/m) and its gradient (A/m^2) at one point of several."""
    side, up = cylinder_field.field(six, rho, outward, across, along)
    slope = cylinder_field.gradient(six, rho, outward, axis, across, along)
    for a in ti.static(range(3)):
        found[a][lane] = side[a] + up * axis[a]
    for a in ti.static(range(5)):
        found[3 + a][lane] = slope[ti.static(GRADIENT_ELEMENTS[a][0]), ti.static(GRADIENT_ELEMENTS[a][1])]


def design(points: np.ndarray, degree: int) -> np.ndarray:
    """Return the matrix from the coefficients of a cell to B and h grad B at points (n, 3) in units of h,
    shape (8 n, number), the values of each of the eight together."""
    first = [solid_harmonics.derivative(a, degree) for a in range(3)]
    b = solid_harmonics.values(points, degree - 1)
    slope = solid_harmonics.values(points, degree - 2)
    columns = [b @ one for one in first]
    columns += [slope @ (solid_harmonics.derivative(c, degree - 1) @ first[a]) for a, c in GRADIENT_ELEMENTS]
    return np.concatenate(columns)


@cache
def _face_nodes() -> np.ndarray:
    """Return points on the faces of the cell -1..1, (n, 3). The error of a field, whose components are
    harmonic, is largest on the faces."""
    x = np.cos(np.pi * (np.arange(FACE_POINTS) + 0.5) / FACE_POINTS)
    plane = np.stack([one.ravel() for one in np.meshgrid(x, x)], axis=1)
    return np.concatenate([np.insert(plane, axis, side, axis=1) for axis in range(3) for side in (-1, 1)])


@cache
def _matrices(degree: int) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return the matrices from coefficients to the values at the nodes, back by least squares, and from the
    coefficients of a cell to the coefficients of its parts."""
    nodes = _face_nodes()
    forward = design(nodes, degree)
    back = np.linalg.pinv(forward)
    scale = np.repeat([1.0] * 3 + [0.5] * 5, len(nodes))[:, None]
    parts = [back @ (scale * design(0.5 * (octant + nodes), degree)) for octant in OCTANTS]
    return forward, back, parts


@dataclass
class Octree:
    """The cells of an octree, breadth first.

    cells : centres and half sides (m), shape (n, 4). child : index of the first of eight parts, -1 for a
    leaf, shape (n,). coefficients : T, shape (n, number). near : the near cylinders of each cell.
    """

    cells: np.ndarray
    child: np.ndarray
    coefficients: np.ndarray
    near: list[np.ndarray]


def expand(
    cylinders: Sequence[Cylinder],
    region: np.ndarray,
    degree: int,
    tolerance: tuple[float, float],
    most_leaves: int,
) -> Octree:
    """Return the octree of cylinders.

    region : centre and half side (m) of the root, shape (4,). tolerance : of B (T) and of its gradient (T/m),
    for each cylinder. most_leaves : largest number of leaves.
    """
    numbers, parts = cylinder_rows.rows(cylinders), _matrices(degree)[2]
    cells, near = region[None], [np.arange(len(cylinders))]
    coefficients = np.zeros((1, solid_harmonics.number(degree)))
    levels: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    every_near: list[np.ndarray] = []
    leaves, first, reach = 1, 0, 0.0
    while True:
        near, reach = _accept(numbers, cells, near, coefficients, tolerance, reach)
        every_near += near
        child = np.full(len(cells), -1)
        levels.append((cells, child, coefficients))
        count = np.array([len(one) for one in near])
        chosen = np.flatnonzero(count > 1)
        room = (most_leaves - leaves) // 7
        if len(chosen) > room:
            chosen = np.sort(chosen[np.argsort(-count[chosen], kind="stable")[:room]])
        if not len(chosen):
            break
        leaves += 7 * len(chosen)
        first += len(cells)
        child[chosen] = first + 8 * np.arange(len(chosen))
        half = 0.5 * cells[chosen, 3]
        centres = cells[chosen, None, :3] + half[:, None, None] * OCTANTS
        coefficients = np.stack([coefficients[chosen] @ part.T for part in parts], axis=1)
        coefficients = coefficients.reshape(-1, coefficients.shape[-1])
        cells = np.column_stack([centres.reshape(-1, 3), np.repeat(half, 8)])
        near = [near[k] for k in chosen for _ in range(8)]
    cells, child, coefficients = (np.concatenate(one) for one in zip(*levels, strict=True))
    return Octree(cells, child, coefficients, every_near)


def _accept(
    numbers: np.ndarray,
    cells: np.ndarray,
    near: Sequence[np.ndarray],
    coefficients: np.ndarray,
    tolerance: tuple[float, float],
    reach: float,
) -> tuple[list[np.ndarray], float]:
    """Add the cylinders that are distant from each cell to its coefficients; return the near ones, and the
    smallest distance of a distant one from the centre of the cell, to its axis or end, in half sides.

    reach : this distance for the larger cells; much closer cylinders are not tried.
    """
    degree = int(np.sqrt(coefficients.shape[1])) - 1
    forward, back, _ = _matrices(degree)
    lengths = [len(one) for one in near]
    pairs = np.stack([np.repeat(np.arange(len(cells)), lengths), np.concatenate(near)], axis=1)
    gap = gaps(numbers, cells[pairs[:, 0], :3], pairs[:, 1])
    size = cells[pairs[:, 0], 3]
    away = (gap + numbers[pairs[:, 1], cylinder_rows.SLOTS["radius"]]) / size
    distant = np.zeros(len(pairs), bool)
    tried = np.flatnonzero((gap > LEAST_GAP * size) & (away > SLACK * reach))
    for begin in range(0, len(tried), CELL_PAIRS_AT_ONCE):
        chosen = tried[begin : begin + CELL_PAIRS_AT_ONCE]
        data = fields(numbers, cells, pairs[chosen], _face_nodes()).reshape(len(chosen), -1)
        fitted = data @ back.T
        wrong = (data - fitted @ forward.T).reshape(len(chosen), 8, -1)
        of_b = np.linalg.norm(wrong[:, :3], axis=1).max(axis=1)
        of_slope = np.linalg.norm(wrong[:, 3:], axis=1).max(axis=1) / size[chosen]
        right = (of_b <= tolerance[0]) & (of_slope <= tolerance[1])
        distant[chosen[right]] = True
        np.add.at(coefficients, pairs[chosen[right], 0], fitted[right])
    left = pairs[~distant]
    ends = np.searchsorted(left[:, 0], np.arange(1, len(cells)))
    return np.split(left[:, 1], ends), float(away[distant].min(initial=np.inf)) if distant.any() else reach


def fields(numbers: np.ndarray, cells: np.ndarray, pairs: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return B (T) outside and h grad B (T) of the cylinder of each pair at the nodes of its cell, shape
    (pairs, 8, nodes)."""
    real, spare = numbers.dtype, -len(nodes) % NODES_TOGETHER
    filled = np.concatenate([nodes, np.zeros((spare, 3))]).T.astype(real, order="C")
    out = np.zeros((len(pairs), 8, filled.shape[1]), real)
    _fields(ClosedEnds(), numbers, cells.astype(real), pairs.astype(np.int32), filled, out)
    return out[:, :, : len(nodes)].astype(float)


def gaps(numbers: np.ndarray, places: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Return the distance (m) of each place from the surface of its cylinder k, negative inside."""
    slot = cylinder_rows.SLOTS
    axis = numbers[k, slot["lead"] : slot["lead"] + 3]
    apart = places - numbers[k, slot["centre"] : slot["centre"] + 3]
    z = np.einsum("ia,ia->i", apart, axis)
    beside = np.linalg.norm(apart - z[:, None] * axis, axis=1) - numbers[k, slot["radius"]]
    beyond = np.abs(z) - 0.5 * numbers[k, slot["length"]]
    outside = np.hypot(np.maximum(beside, 0), np.maximum(beyond, 0))
    return np.where((beside < 0) & (beyond < 0), np.maximum(beside, beyond), outside)
