"""Random sequential addition: spheres placed one after another at random, where they do not overlap.

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


@in_taichi_thread
@ti.kernel
def _add(
    centres: ti.types.ndarray(),  # type: ignore[valid-type]
    heads: ti.types.ndarray(),  # type: ignore[valid-type]
    follow: ti.types.ndarray(),  # type: ignore[valid-type]
    spheres: ti.i32,
    radius: ti.f64,
    seed: ti.u64,
    max_failures: ti.i32,
    x_low: ti.f64,
    y_low: ti.f64,
    z_low: ti.f64,
    x_side: ti.f64,
    y_side: ti.f64,
    z_side: ti.f64,
    nx: ti.i32,
    ny: ti.i32,
    nz: ti.i32,
    x_periodic: ti.i32,
    y_periodic: ti.i32,
    z_periodic: ti.i32,
    ball: ti.i32,
) -> ti.i32:
    """Place the spheres; return how many found room.

    ``heads`` has the last member of each cell, and ``follow`` the one before each sphere in its cell; -1
    where there is none.
    """
    placed = 0
    ti.loop_config(serialize=True)
    for _once in range(1):
        side, low = ti.Vector([x_side, y_side, z_side]), ti.Vector([x_low, y_low, z_low])
        dims, periodic = ti.Vector([nx, ny, nz]), ti.Vector([x_periodic, y_periodic, z_periodic])
        attempt = ti.cast(0, ti.u64)
        stuck = False
        for i in range(spheres):
            free = False
            tries = 0
            while not free and tries < max_failures and not stuck:
                a = philox.uniform(philox.bits(seed, SEQUENTIAL_ADDITION, 0, attempt, 0))
                b = philox.uniform(philox.bits(seed, SEQUENTIAL_ADDITION, 0, attempt, 1))
                u = ti.Vector([a[0], a[1], b[0]])
                attempt += ti.cast(1, ti.u64)
                if ball == 0 or (u - 0.5).norm_sqr() <= 0.25:
                    tries += 1
                    cell = ti.min(ti.floor(u * dims, ti.i32), dims - 1)
                    x = low + u * side
                    free = True
                    for k in range(27):
                        # From the cell itself on: most places that are taken are found to be so there.
                        turn = (k + 13) % 27
                        c = cell + ti.Vector([turn // 9 - 1, turn // 3 % 3 - 1, turn % 3 - 1])
                        c = ti.select(periodic > 0, (c + dims) % dims, c)
                        if free and c.min() >= 0 and (c < dims).all():
                            at = (c[0] * dims[1] + c[1]) * dims[2] + c[2]
                            j = heads[at]
                            while j >= 0:
                                gap = ti.Vector([
                                    x[0] - centres[j, 0], x[1] - centres[j, 1], x[2] - centres[j, 2]
                                ])  # fmt: skip
                                gap -= ti.select(periodic > 0, side * ti.round(gap / side), 0.0)
                                if gap.norm_sqr() < 4.0 * radius * radius:
                                    free = False
                                j = follow[j]
                    if free:
                        at = (cell[0] * dims[1] + cell[1]) * dims[2] + cell[2]
                        follow[i] = heads[at]
                        heads[at] = i
                        for k in ti.static(range(3)):
                            centres[i, k] = x[k]
            if free:
                placed += 1
            else:
                stuck = True
    return placed


def place(count: int, radius: float, region: Region, seed: int) -> np.ndarray:
    """Return centres, shape (count, 3) in m, of equal spheres of ``radius`` (m) in a region, none
    overlapping.

    Depends on the arguments alone, not on device or threads. Goes up to saturation: InputError, which says
    the volume fraction reached, when no further sphere fits.
    """
    runtime.current()
    check_resolved("places of the packing", np.stack([region.low, region.high]), radius)
    sphere = 4 / 3 * np.pi * radius**3
    # Refused at once where no choice of places would do: a few spheres can exceed the limit of many.
    most = (SATURATION_FRACTION + count**-0.5) * region.reachable_volume(radius) / region.volume
    fraction = count * sphere / region.volume
    rule = f"at most {SATURATION_FRACTION:.3f}, where random sequential addition of many spheres ends"
    must(fraction <= most, "volume fraction", rule, float(f"{fraction:.4g}"))
    centres = _everywhere(count, radius, region, seed)
    if len(centres) < count:
        generator = np.random.Generator(np.random.Philox(key=[seed, SEQUENTIAL_ADDITION]))
        centres = fill(centres, count, 2 * radius, region, generator)
    if len(centres) < count:
        raise InputError(
            f"volume fraction must be at most {len(centres) * sphere / region.volume:.4f}, where no further "
            f"sphere fits ({len(centres)} of {count} were placed); received {fraction:.4f}"
        )
    return centres


def _everywhere(count: int, radius: float, region: Region, seed: int) -> np.ndarray:
    """Return the first centres, found by trying places in all of the region."""
    # Cells at least a diameter wide, so that overlaps are found in the 27 cells around.
    dims = np.clip(np.floor(region.side / (2.0 * radius)), 1, MAX_CELLS).astype(int)
    heads = np.full(int(np.prod(dims)), -1, dtype=np.int32)
    centres, follow = np.zeros((count, 3)), np.full(count, -1, dtype=np.int32)
    placed = _add(
        centres,
        heads,
        follow,
        count,
        radius,
        seed,
        MAX_CONSECUTIVE_FAILURES,
        *region.low.tolist(),
        *region.side.tolist(),
        *dims.tolist(),
        *region.periodic,
        region.ball,
    )
    return centres[:placed]
