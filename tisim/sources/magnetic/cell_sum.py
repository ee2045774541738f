"""The sum of the fields of many cylinders: near ones one by one, distant ones by the expansion of a cell.

The octree of local_expansions.py is packed into one row of numbers for each world, whose length depends on
the capacity of the list of cylinders only:

    centre and half side of the root; the first part of each node, or -1 - leaf; for each leaf the first and
    the last of its near cylinders in the list, and its coefficients; the list of near cylinders
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.errors import must
from tisim.numerics import solid_harmonics
from tisim.sources.magnetic import cylinder_rows
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.local_expansions import GRADIENT_ELEMENTS, Octree, design, expand, fields, gaps

Corners = tuple[Vector, Vector]
"""The lower and the upper corner of a box."""
LEAVES_PER_CYLINDER, NEAR_PER_LEAF = 64, 12
"""Number of leaves for each cylinder that a list can hold, and of near cylinders for each leaf."""
DEGREES = {2: 6, 3: 8, 4: 9, 5: 10}
"""Degree of the polynomials by the number of digits; the fastest (tests/benchmarks/many_fibres.py)."""
FIRST_TOLERANCE, TRIES = 0.05, 4
"""First tolerance for one cylinder, over the wanted error of the sum, and number of tolerances tried."""
ERROR_MARGIN = 1.5
"""Upper bound on the largest error in the region over the largest at the tested points."""
KEPT_OCTREES = 16
"""Number of octrees that are kept, as a scene asks for its own several times."""
BOXES, BOX_POINTS = 400, 16
"""Number of small boxes in which errors are measured, and of points in each."""


def _numbers(cylinders: int) -> tuple[int, int, int]:
    """Return the numbers of nodes, of leaves and of near cylinders in all for a list of this capacity."""
    leaves = LEAVES_PER_CYLINDER * cylinders
    return (8 * leaves) // 7 + 1, leaves, NEAR_PER_LEAF * leaves


def row_size(cylinders: int, digits: int) -> int:
    """Return the length of a packed row for a list of this capacity."""
    nodes, leaves, listed = _numbers(cylinders)
    return 4 + nodes + (2 + solid_harmonics.number(DEGREES[digits])) * leaves + listed


def _region(cylinders: Sequence[Cylinder]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper corner (m) of the box about all cylinders."""
    centre, axis = np.array([c.centre for c in cylinders]), np.array([c.direction for c in cylinders])
    radius, half = np.array([(c.radius, 0.5 * c.length) for c in cylinders]).T[:, :, None]
    reach = half * np.abs(axis) + radius * np.sqrt(np.maximum(1 - axis**2, 0))
    return (centre - reach).min(axis=0), (centre + reach).max(axis=0)


def _typical(numbers: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[float, float]:
    """Return the mean magnitudes of B (T) and of its gradient (T/m) at random places between the
    cylinders."""
    draw = np.random.Generator(np.random.Philox(17))
    places = np.column_stack([draw.uniform(low, high, (BOXES, 3)), np.full(BOXES, 0.02 * (high - low).max())])
    nodes = draw.uniform(-1, 1, (BOX_POINTS, 3))
    pairs = np.stack(np.divmod(np.arange(BOXES * len(numbers)), len(numbers)), axis=1)
    total = fields(numbers, places, pairs, nodes).reshape(BOXES, len(numbers), 8, -1).sum(axis=1)
    points = (places[:, None, :3] + places[:, None, 3:] * nodes).reshape(-1, 3)
    every = np.stack(np.divmod(np.arange(len(points) * len(numbers)), len(numbers)), axis=1)
    free = gaps(numbers, points[every[:, 0]], every[:, 1]).reshape(len(points), -1).min(axis=1) > 0
    if not free.any():
        free[:] = True
    of_b = np.linalg.norm(total[:, :3], axis=1).ravel()
    of_slope = _norm(total[:, 3:]).ravel() / places[0, 3]
    return float(of_b[free].mean()), float(of_slope[free].mean())


def _norm(slope: np.ndarray) -> np.ndarray:
    """Return the norm of gradients given by the five elements of ``GRADIENT_ELEMENTS``, shape (n, 5, ...)."""
    squares = sum((1.0 if a == c else 2.0) * slope[:, k] ** 2 for k, (a, c) in enumerate(GRADIENT_ELEMENTS))
    norm: np.ndarray = np.sqrt(squares + (slope[:, 0] + slope[:, 3]) ** 2)
    return norm


def _errors(numbers: np.ndarray, tree: Octree, degree: int) -> tuple[float, float]:
    """Return the largest error of B (T) and of its gradient (T/m) at random points of leaves, the larger ones
    more often."""
    draw = np.random.Generator(np.random.Philox(18))
    leaves = np.flatnonzero(tree.child < 0)
    weight = tree.cells[leaves, 3]
    chosen = draw.choice(leaves, BOXES, p=weight / weight.sum())
    nodes = draw.uniform(-1, 1, (BOX_POINTS, 3))
    distant = np.ones((BOXES, len(numbers)), bool)
    for row, leaf in zip(distant, chosen, strict=True):
        row[tree.near[leaf]] = False
    pairs = np.argwhere(distant)
    each = fields(numbers, tree.cells[chosen], pairs, nodes)
    expected = np.zeros((BOXES, 8, BOX_POINTS))
    np.add.at(expected, pairs[:, 0], each)
    wrong = (tree.coefficients[chosen] @ design(nodes, degree).T).reshape(expected.shape) - expected
    of_slope = _norm(wrong[:, 3:]).max(axis=1) / tree.cells[chosen, 3]
    return float(np.linalg.norm(wrong[:, :3], axis=1).max()), float(of_slope.max())


def cell_row(
    cylinders: Sequence[Cylinder], digits: int, box: Corners | None = None, room: int = 0
) -> np.ndarray:
    """Return the packed octree for cylinders, made once for the running settings; raise InputError if it
    cannot be as accurate as wanted.

    box : corners of the box in which the sum is wanted, m; if not given, twice the box about all cylinders.
    room : number of cylinders for which the row has room, if more than these.
    """
    needed = Cylinder.list_capacity(len(cylinders))
    # Limits are those of a world alone, so that its sum is the same to the last bit in every batch.
    sizes, most_listed = _numbers(max(needed, room)), _numbers(needed)[2]
    tree = _octree(tuple(cylinders), digits, box, runtime.current())
    return _packed(tree, DEGREES[digits], sizes, most_listed)


@lru_cache(maxsize=KEPT_OCTREES)
def _octree(
    cylinders: tuple[Cylinder, ...], digits: int, box: Corners | None, settings: runtime.Runtime
) -> Octree | None:
    """Return the octree, None without magnetised cylinders."""
    if not any(any(one.magnetisation) for one in cylinders):
        return None
    numbers, (low, high) = cylinder_rows.rows(cylinders), _region(cylinders)
    root = np.array([*(0.5 * (low + high)), (high - low).max()])
    most_leaves = _numbers(Cylinder.list_capacity(len(cylinders)))[1]
    if box is not None:
        low, high = np.array(box)
        root = np.array([*(0.5 * (low + high)), 0.5 * (high - low).max()])
        ends = [_region([one]) for one in cylinders]
        there = sum(bool((first < high).all() and (last > low).all()) for first, last in ends)
        most_leaves = LEAVES_PER_CYLINDER * max(there, 1)
    typical = np.array(_typical(numbers, low, high))
    part = FIRST_TOLERANCE
    for _ in range(TRIES):
        b, slope = part * 10.0**-digits * typical
        tree = expand(cylinders, root, DEGREES[digits], (b, slope), most_leaves)
        error = ERROR_MARGIN * float((np.array(_errors(numbers, tree, DEGREES[digits])) / typical).max())
        if error <= 10.0**-digits:
            return tree
        part *= min(0.5, 0.8 * 10.0**-digits / error)
    must(False, "sum_digits", f"fewer for these cylinders in {settings.precision}", digits)
    raise AssertionError


def _packed(tree: Octree | None, degree: int, sizes: tuple[int, int, int], most_listed: int) -> np.ndarray:
    """Return the row of an octree. A leaf whose near cylinders would make the list longer than
    ``most_listed`` is marked by a last one before the first; there all cylinders are summed directly. No tree
    stands for a root of size 0."""
    nodes, leaves, listed = sizes
    width = 2 + solid_harmonics.number(degree)
    row = np.zeros(4 + nodes + width * leaves + listed)
    if tree is None:
        return row
    row[:4] = tree.cells[0]
    ends = np.flatnonzero(tree.child < 0)
    number = np.full(len(tree.child), -1)
    number[ends] = -1 - np.arange(len(ends))
    row[4 : 4 + len(number)] = np.where(tree.child < 0, number, tree.child)
    table, used = row[4 + nodes : 4 + nodes + width * leaves].reshape(leaves, width), 0
    small = 1e-12 * np.abs(tree.coefficients).max()
    for k, leaf in enumerate(ends):
        near = tree.near[leaf]
        if used + len(near) > most_listed:
            table[k, :2] = 0, -1
            continue
        at = 4 + nodes + width * leaves + used
        row[at : at + len(near)] = near
        table[k, :2] = used, used + len(near)
        used += len(near)
        # In f32, smaller coefficients could be too small for a number.
        table[k, 2:] = np.where(np.abs(tree.coefficients[leaf]) > small, tree.coefficients[leaf], 0.0)
    return row


@ti.data_oriented
class CellSum:
    """The sum over the cylinders of a world, in kernels.

    number : reader of the packed row. capacity : of the list of cylinders. digits : as in ``cell_row``.
    """

    def __init__(self, number: Callable[..., Any], capacity: int, digits: int) -> None:
        self.number, self.degree = number, DEGREES[digits]
        self.nodes, self.leaves, _ = _numbers(capacity)
        self.width = 2 + solid_harmonics.number(self.degree)
        self.listed = 4 + self.nodes + self.width * self.leaves

    @ti.func
    def leaf(self, w, r):
        """Return the number of the leaf around r (m), -1 outside the root; r in half sides from the centre of
        the leaf; and the half side (m)."""
        centre, half = ti.Vector([self.number(w, a) for a in ti.static(range(3))]), self.number(w, 3)
        node, x = -1, r - centre
        if ti.max(ti.abs(x[0]), ti.abs(x[1]), ti.abs(x[2])) < half:
            node = ti.cast(self.number(w, 4), ti.i32)
            while node >= 0:
                half *= 0.5
                part = 0
                for a in ti.static(range(3)):
                    above = x[a] > 0.0
                    part += ti.select(above, 4 >> a, 0)
                    x[a] -= ti.select(above, half, -half)
                node = ti.cast(self.number(w, 4 + node + part), ti.i32)
            node = -1 - node
        return node, x / half, half

    @ti.func
    def near(self, w, leaf):
        """Return the first and the last place of the near cylinders of a leaf in the list."""
        at = 4 + self.nodes + self.width * leaf
        return ti.cast(self.number(w, at), ti.i32), ti.cast(self.number(w, at + 1), ti.i32)

    @ti.func
    def index(self, w, e):
        """Return the index of the cylinder at a place in the list."""
        return ti.cast(self.number(w, self.listed + e), ti.i32)

    @ti.func
    def distant(self, w, leaf, x, half, slopes: ti.template()):  # type: ignore[valid-type]
        """Return B (T) of the distant cylinders of a leaf and its gradient (T/m), 0 unless ``slopes``."""
        size = ti.static(solid_harmonics.number(self.degree - 1))
        basis, zero = ti.Vector([0.0 * half] * size), 0.0 * half
        solid_harmonics.basis(x, basis)
        potential = ti.Vector([zero] * ti.static(solid_harmonics.number(self.degree)))
        first = 4 + self.nodes + self.width * leaf + 2
        for k in range(ti.static(potential.n)):
            potential[k] = self.number(w, first + k)
        parts = [ti.Vector([zero] * size) for _ in ti.static(range(3))]
        b, slope = 0.0 * x, 0.0 * x.outer_product(x)
        for n in range(self.degree):
            for m in range(n + 1):
                k = n * (n + 1) + 2 * m
                for a in ti.static(range(3)):
                    one = solid_harmonics.shifted(potential, n, m, a)
                    b[a] += one[0] * basis[k] + one[1] * basis[k + 1]
                    parts[a][k], parts[a][k + 1] = one[0], one[1]
        if ti.static(slopes):
            for n in range(self.degree - 1):
                for m in range(n + 1):
                    k = n * (n + 1) + 2 * m
                    for a, c in ti.static(GRADIENT_ELEMENTS):
                        one = solid_harmonics.shifted(parts[a], n, m, c)
                        slope[a, c] += one[0] * basis[k] + one[1] * basis[k + 1]
            slope[2, 2] = -slope[0, 0] - slope[1, 1]
            for a, c in ti.static(((0, 1), (0, 2), (1, 2))):
                slope[c, a] = slope[a, c]
        return b, slope / half
