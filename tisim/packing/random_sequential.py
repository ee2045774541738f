"""Random sequential addition: spheres placed one after another at random, where they do not overlap.

Of unlike ones the largest come first, which leave room for the small ones between them.

B. Widom, J. Chem. Phys. 44 (1966) 3888. The start of Z04 section 8 ("initially non-intersecting") and of
Z16 section 9. Equal spheres jam at a volume fraction of 0.3841 in the bulk (G. Zhang and S. Torquato,
Phys. Rev. E 88 (2013) 053312), at less between walls.
"""

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.ranges import check_resolved
from tisim.errors import InputError, must
from tisim.geometry import round_box
from tisim.numerics import philox
from tisim.numerics.random_streams import SEQUENTIAL_ADDITION
from tisim.packing.region import Region
from tisim.packing.saturation import fill

SATURATION_FRACTION = 0.3841
"""At this volume fraction no further sphere fits, in the bulk."""
MAX_CONSECUTIVE_FAILURES = 5_000
"""After so many failures in a row places are no longer tried everywhere, only where there is room."""
MAX_CELLS = 128
"""The list of neighbours has so many cells along an axis at most: 8 MB of them, for a million spheres."""
MAX_LEVELS = 12
"""Spheres of half the size have smaller cells; from the size ratio 2^11 on no smaller ones."""


@in_taichi_thread
@ti.kernel
def _add(
    centres: ti.types.ndarray(),  # type: ignore[valid-type]
    heads: ti.types.ndarray(),  # type: ignore[valid-type]
    follow: ti.types.ndarray(),  # type: ignore[valid-type]
    radii: ti.types.ndarray(),  # type: ignore[valid-type]
    levels: ti.types.ndarray(),  # type: ignore[valid-type]
    cells: ti.types.ndarray(),  # type: ignore[valid-type]
    walls: ti.types.ndarray(),  # type: ignore[valid-type]
    axes: ti.types.ndarray(),  # type: ignore[valid-type]
    seed: ti.u64,
    max_failures: ti.i32,
) -> ti.i32:
    """Place the spheres, whose radii never rise; return how many found room.

    ``levels`` has the level of each sphere, ``cells`` the first cell of each level and how many it has along
    each axis. ``heads`` has the last member of each cell, and ``follow`` the one before each sphere in its
    cell; -1 where there is none. ``walls`` has the corner and sides of the region of the largest sphere, and
    of the smallest; ``axes`` whether each is periodic, round and walled.
    """
    placed = 0
    ti.loop_config(serialize=True)
    for _once in range(1):
        low, side = _row(walls, 0), _row(walls, 1)
        widest_low, widest_side = _row(walls, 2), _row(walls, 3)
        periodic, rounded, walled = _row(axes, 0), _row(axes, 1), _row(axes, 2)
        attempt = ti.cast(0, ti.u64)
        stuck = False
        for i in range(radii.shape[0]):
            radius, level = radii[i], levels[i]
            wider = walled * (radii[0] - radius)
            free = False
            tries = 0
            while not free and tries < max_failures and not stuck:
                a = philox.uniform(philox.bits(seed, SEQUENTIAL_ADDITION, 0, attempt, 0))
                b = philox.uniform(philox.bits(seed, SEQUENTIAL_ADDITION, 0, attempt, 1))
                u = ti.Vector([a[0], a[1], b[0]])
                attempt += ti.cast(1, ti.u64)
                if round_box.contains(rounded, ti.Vector([0.5, 0.5, 0.5]), u - 0.5):
                    tries += 1
                    x = low - wider + u * (side + 2.0 * wider)
                    place = (x - widest_low) / widest_side
                    free = True
                    # From the cell itself on: most places that are taken are found to be so there.
                    for k in range(27 * (level + 1)):
                        m, turn = level - k // 27, (k + 13) % 27
                        dims = ti.Vector([cells[m, 1], cells[m, 2], cells[m, 3]])
                        cell = ti.max(0, ti.min(ti.floor(place * dims, ti.i32), dims - 1))
                        c = cell + ti.Vector([turn // 9 - 1, turn // 3 % 3 - 1, turn % 3 - 1])
                        c = ti.select(periodic > 0.0, (c + dims) % dims, c)
                        if free and c.min() >= 0 and (c < dims).all():
                            j = heads[cells[m, 0] + (c[0] * dims[1] + c[1]) * dims[2] + c[2]]
                            while j >= 0:
                                gap = ti.Vector([
                                    x[0] - centres[j, 0], x[1] - centres[j, 1], x[2] - centres[j, 2]
                                ])  # fmt: skip
                                gap -= periodic * side * ti.round(gap / side)
                                apart = radius + radii[j]
                                if gap.norm_sqr() < apart * apart:
                                    free = False
                                j = follow[j]
                    if free:
                        dims = ti.Vector([cells[level, 1], cells[level, 2], cells[level, 3]])
                        cell = ti.max(0, ti.min(ti.floor(place * dims, ti.i32), dims - 1))
                        at = cells[level, 0] + (cell[0] * dims[1] + cell[1]) * dims[2] + cell[2]
                        follow[i] = heads[at]
                        heads[at] = i
                        for k in ti.static(range(3)):
                            centres[i, k] = x[k]
            if free:
                placed += 1
            else:
                stuck = True
    return placed


@ti.func
def _row(array: ti.template(), k):  # type: ignore[valid-type]
    return ti.Vector([array[k, 0], array[k, 1], array[k, 2]])


def place(radii: np.ndarray, region: Region, seed: int) -> np.ndarray:
    """Return centres, shape (n, 3) in m, of spheres of these radii (m), shape (n,), none overlapping.

    region : of the centres of the largest. Depends on the arguments alone, not on device or threads. Equal
    spheres go up to saturation. InputError, which says the volume fraction reached, when no further sphere
    fits.
    """
    runtime.current()
    count, largest, smallest = len(radii), float(radii.max()), float(radii.min())
    check_resolved("places of the packing", np.stack([region.low, region.high]), smallest)
    spheres = 4 / 3 * np.pi * radii**3
    fraction, equal = float(spheres.sum()) / region.volume, smallest == largest
    # Refused at once where no choice of places would do: a few spheres can exceed the limit of many.
    most = (SATURATION_FRACTION + count**-0.5) * region.reachable_volume(largest) / region.volume
    rule = f"at most {SATURATION_FRACTION:.3f}, where random sequential addition of many spheres ends"
    must(fraction <= most or not equal, "volume fraction", rule, float(f"{fraction:.4g}"))
    order = np.argsort(-radii, kind="stable")
    centres = _everywhere(radii[order], region, seed)
    if len(centres) < count and equal:
        generator = np.random.Generator(np.random.Philox(key=[seed, SEQUENTIAL_ADDITION]))
        centres = fill(centres, count, 2 * largest, region, generator)
    if len(centres) < count:
        reached = float(spheres[order][: len(centres)].sum()) / region.volume
        raise InputError(
            f"volume fraction must be at most {reached:.4f}, where no further "
            f"sphere fits ({len(centres)} of {count} were placed); received {fraction:.4f}"
        )
    return centres[np.argsort(order, kind="stable")]


def _everywhere(radii: np.ndarray, region: Region, seed: int) -> np.ndarray:
    """Return the first centres, found by trying places in all of the region; radii never rise."""
    widest = region.for_radius(float(radii[0]), float(radii[-1]))
    # Cells of each level at least a diameter wide, so that overlaps are found in the 27 cells around.
    levels = np.minimum(np.log2(radii[0] / radii), MAX_LEVELS - 1).astype(np.int32)
    widths = 2.0 * radii[0] * 0.5 ** np.arange(levels[-1] + 1)
    dims = np.clip(np.floor(widest.side / widths[:, None]), 1, MAX_CELLS).astype(np.int32)
    ends = np.cumsum(dims.prod(axis=1), dtype=np.int32)
    cells = np.column_stack([np.concatenate([[0], ends[:-1]]), dims]).astype(np.int32)
    heads = np.full(ends[-1], -1, dtype=np.int32)
    centres, follow = np.zeros((len(radii), 3)), np.full(len(radii), -1, dtype=np.int32)
    walls = np.stack([region.low, region.side, widest.low, widest.side])
    axes = np.array([region.periodic, round_box.ROUND[region.shape], region.walled], float)
    placed = _add(centres, heads, follow, radii, levels, cells, walls, axes, seed, MAX_CONSECUTIVE_FAILURES)
    return centres[:placed]
