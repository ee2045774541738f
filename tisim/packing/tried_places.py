"""Random sequential addition by insertion trials everywhere; packings are made in parallel, one per
thread."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.geometry import round_box
from tisim.numerics import philox
from tisim.numerics.random_streams import SEQUENTIAL_ADDITION
from tisim.packing.region import Region
from tisim.program.tasks import iterations_of_task

MAX_CONSECUTIVE_FAILURES = 5_000
"""After this number of consecutive failures, trials are made only in the remaining free space."""
MAX_CELLS = 128
"""Largest number of cells of the neighbour list along an axis: 8 MB for a million spheres."""
CELLS_OF_A_SPHERE = 8
"""Approximate largest number of cells of a level per sphere."""
MAX_LEVELS = 12
"""Each level of cells is for spheres of half the size; there are none for size ratios above 2^11."""


@in_taichi_thread
@ti.kernel
def _add(
    spheres: ti.types.ndarray(),  # type: ignore[valid-type]
    chains: ti.types.ndarray(),  # type: ignore[valid-type]
    levels: ti.types.ndarray(),  # type: ignore[valid-type]
    heads: ti.types.ndarray(),  # type: ignore[valid-type]
    packings: ti.types.ndarray(),  # type: ignore[valid-type]
    regions: ti.types.ndarray(),  # type: ignore[valid-type]
    seeds: ti.types.ndarray(),  # type: ignore[valid-type]
    task: ti.i32,
):
    """Place the spheres of each packing, ordered by decreasing radius.

    spheres : radius and centre of each sphere.
    chains : level of each sphere, and the previous sphere in its cell.
    levels : first cell of each level, and its number of cells along each axis.
    heads : last sphere in each cell; -1 if there is none.
    packings : first sphere of each packing, the one after the last, its first level, and then the number of
        spheres placed.
    regions : corner and sides of the region of the largest sphere, and of the smallest, and for each axis
        whether it is periodic, round and walled.
    task : smallest number of loop iterations that a thread takes (tisim/program/tasks.py).
    """
    for iteration in range(packings.shape[0] * task):
        if iteration % task == 0:
            p = iteration // task
            packings[p, 3] = _placed(spheres, chains, levels, heads, packings, regions, seeds[p], p)


@ti.func
def _placed(
    spheres: ti.template(),  # type: ignore[valid-type]
    chains: ti.template(),  # type: ignore[valid-type]
    levels: ti.template(),  # type: ignore[valid-type]
    heads: ti.template(),  # type: ignore[valid-type]
    packings: ti.template(),  # type: ignore[valid-type]
    regions: ti.template(),  # type: ignore[valid-type]
    seed,
    p,
):
    """Place the spheres of a packing; return the number placed."""
    low, side = _row(regions, p, 0), _row(regions, p, 1)
    widest_low, widest_side = _row(regions, p, 2), _row(regions, p, 3)
    periodic, rounded, walled = _row(regions, p, 4), _row(regions, p, 5), _row(regions, p, 6)
    first, lowest = packings[p, 0], packings[p, 2]
    attempt = ti.cast(0, ti.u64)
    placed = 0
    stuck = False
    for i in range(first, packings[p, 1]):
        radius, level = spheres[i, 0], chains[i, 0]
        wider = walled * (spheres[first, 0] - radius)
        free = False
        tries = 0
        while not free and tries < MAX_CONSECUTIVE_FAILURES and not stuck:
            a = philox.uniform(philox.bits(seed, SEQUENTIAL_ADDITION, 0, attempt, 0))
            b = philox.uniform(philox.bits(seed, SEQUENTIAL_ADDITION, 0, attempt, 1))
            u = ti.Vector([a[0], a[1], b[0]])
            attempt += ti.cast(1, ti.u64)
            if round_box.contains(rounded, ti.Vector([0.5, 0.5, 0.5]), u - 0.5):
                tries += 1
                x = low - wider + u * (side + 2.0 * wider)
                place = (x - widest_low) / widest_side
                free = True
                # Start from the cell itself, in which most overlaps are found.
                for k in range(27 * (level + 1)):
                    m, turn = lowest + level - k // 27, (k + 13) % 27
                    dims = ti.Vector([levels[m, 1], levels[m, 2], levels[m, 3]])
                    cell = ti.max(0, ti.min(ti.floor(place * dims, ti.i32), dims - 1))
                    c = cell + ti.Vector([turn // 9 - 1, turn // 3 % 3 - 1, turn % 3 - 1])
                    c = ti.select(periodic > 0.0, (c + dims) % dims, c)
                    if free and c.min() >= 0 and (c < dims).all():
                        j = heads[levels[m, 0] + (c[0] * dims[1] + c[1]) * dims[2] + c[2]]
                        while j >= 0:
                            gap = x - ti.Vector([spheres[j, 1], spheres[j, 2], spheres[j, 3]])
                            gap -= periodic * side * ti.round(gap / side)
                            apart = radius + spheres[j, 0]
                            if gap.norm_sqr() < apart * apart:
                                free = False
                            j = chains[j, 1]
                if free:
                    m = lowest + level
                    dims = ti.Vector([levels[m, 1], levels[m, 2], levels[m, 3]])
                    cell = ti.max(0, ti.min(ti.floor(place * dims, ti.i32), dims - 1))
                    at = levels[m, 0] + (cell[0] * dims[1] + cell[1]) * dims[2] + cell[2]
                    chains[i, 1] = heads[at]
                    heads[at] = i
                    for k in ti.static(range(3)):
                        spheres[i, 1 + k] = x[k]
        if free:
            placed += 1
        else:
            stuck = True
    return placed


@ti.func
def _row(array: ti.template(), p, k):  # type: ignore[valid-type]
    return ti.Vector([array[p, k, 0], array[p, k, 1], array[p, k, 2]])


@dataclass(frozen=True, eq=False)
class Packing:
    """A packing of at least one sphere, with radii (m), shape (n,), and a random seed.

    region : region of the centres of the largest spheres.
    """

    radii: np.ndarray
    region: Region
    seed: int

    @cached_property
    def order(self) -> np.ndarray:
        """The order in which spheres are placed: the largest first."""
        return np.argsort(-self.radii, kind="stable")

    @property
    def equal(self) -> bool:
        """Whether all spheres have the same radius."""
        return bool((self.radii == self.radii[0]).all())

    def fraction(self, count: int) -> float:
        """Return the volume fraction of the first ``count`` spheres in order of placement, in the region's
        container."""
        return float((4 / 3 * np.pi * self.radii**3)[self.order][:count].sum()) / self.region.volume

    def generator(self) -> np.random.Generator:
        """Return a generator of further random numbers, for completing a packing after trials everywhere."""
        return np.random.Generator(np.random.Philox(key=[self.seed, SEQUENTIAL_ADDITION]))

    def key(self) -> tuple[bytes, bytes, int]:
        """Return a key of everything that determines the positions of the spheres."""
        return self.radii.tobytes(), self.rows.tobytes(), self.seed

    @cached_property
    def rows(self) -> np.ndarray:
        """Row of the packing in ``regions`` of the kernel, shape (7, 3)."""
        region = self.region
        widest = region.for_radius(float(self.radii.max()), float(self.radii.min()))
        axes = (region.periodic, round_box.ROUND[region.shape], region.walled)
        return np.array([region.low, region.side, widest.low, widest.side, *axes], float)


def everywhere(packings: Sequence[Packing]) -> list[np.ndarray]:
    """Return for each packing the centres, m, shape (placed, 3), of the spheres that were placed by trials in
    its whole region, in order of placement."""
    grids = [_cells(packing) for packing in packings]
    radii = [packing.radii[packing.order] for packing in packings]
    ends, lowest = np.cumsum([len(one) for one in radii]), np.cumsum([0, *map(len, grids)])[:-1]
    dims = np.concatenate(grids)
    cells = np.cumsum(dims.prod(axis=1))
    spheres, chains = np.zeros((ends[-1], 4)), np.full((ends[-1], 2), -1, np.int32)
    spheres[:, 0] = np.concatenate(radii)
    chains[:, 0] = np.concatenate([_levels(one) for one in radii])
    levels = np.column_stack([np.concatenate([[0], cells[:-1]]), dims]).astype(np.int32)
    heads = np.full(cells[-1], -1, np.int32)
    starts = np.concatenate([[0], ends[:-1]])
    ranges = np.column_stack([starts, ends, lowest, 0 * ends]).astype(np.int32)
    regions = np.stack([packing.rows for packing in packings])
    seeds = np.array([packing.seed for packing in packings], np.uint64)
    _add(spheres, chains, levels, heads, ranges, regions, seeds, iterations_of_task())
    return [spheres[first : first + placed, 1:] for first, _, _, placed in ranges]


def _levels(radii: np.ndarray) -> np.ndarray:
    """Return the level of each sphere, given decreasing radii: spheres of half the size have smaller
    cells."""
    return np.minimum(np.log2(radii[0] / radii), MAX_LEVELS - 1).astype(np.int32)


def _cells(packing: Packing) -> np.ndarray:
    """Return the number of cells of each level along each axis, shape (levels, 3).

    Cells are at least a diameter wide, so that overlaps are found in the 27 neighbouring cells, and not many
    more than spheres.
    """
    largest, side = float(packing.radii.max()), packing.rows[3]
    levels = int(_levels(np.array([largest, packing.radii.min()]))[1]) + 1
    widths = 2.0 * largest * 0.5 ** np.arange(levels)
    dims = np.clip(np.floor(side / widths[:, None]), 1, MAX_CELLS)
    too_many = np.maximum(dims.prod(axis=1) / (CELLS_OF_A_SPHERE * len(packing.radii)), 1.0)
    several = np.maximum((dims > 1).sum(axis=1), 1)
    return np.maximum(np.floor(dims / (too_many ** (1 / several))[:, None]), 1).astype(np.int32)
