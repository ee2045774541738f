"""Random sequential addition: spheres placed one after another at random, where they do not overlap.

B. Widom, J. Chem. Phys. 44 (1966) 3888. The start of Z04 section 8 ("initially non-intersecting") and of
Z16. Equal spheres jam at a volume fraction of 0.38; far below it the work is linear in their number.
"""

import numpy as np

from tisim import noise, runtime
from tisim._taichi import ti
from tisim.errors import InputError, must

STREAM = 0x52534100
ATTEMPTS = 100_000
CELLS = 64
PER_CELL = 8


@ti.kernel
def _add(
    centres: ti.types.ndarray(),  # type: ignore[valid-type]
    cells: ti.types.ndarray(),  # type: ignore[valid-type]
    spheres: ti.i32,
    radius: ti.f64,
    seed: ti.u64,
    attempts: ti.i32,
    x_low: ti.f64,
    y_low: ti.f64,
    z_low: ti.f64,
    x_side: ti.f64,
    y_side: ti.f64,
    z_side: ti.f64,
    nx: ti.i32,
    ny: ti.i32,
    nz: ti.i32,
    periodic: ti.i32,
) -> ti.i32:
    """Place the spheres; returns how many found room. ``cells[c, 0]`` counts the members that follow it."""
    placed = 0
    ti.loop_config(serialize=True)
    for _once in range(1):
        side, low = ti.Vector([x_side, y_side, z_side]), ti.Vector([x_low, y_low, z_low])
        dims = ti.Vector([nx, ny, nz])
        attempt = ti.cast(0, ti.u64)
        stuck = False
        for i in range(spheres):
            free = False
            tries = 0
            while not free and tries < attempts and not stuck:
                a = noise.uniform(noise.bits(seed, STREAM, 0, attempt, 0))
                b = noise.uniform(noise.bits(seed, STREAM, 0, attempt, 1))
                u = ti.Vector([a[0], a[1], b[0]])
                attempt += ti.cast(1, ti.u64)
                tries += 1
                cell = ti.min(ti.floor(u * dims, ti.i32), dims - 1)
                x = low + u * side
                free = True
                for dx, dy, dz in ti.static(ti.ndrange((-1, 2), (-1, 2), (-1, 2))):
                    c = cell + ti.Vector([dx, dy, dz])
                    if periodic > 0:
                        c = (c + dims) % dims
                    if c.min() >= 0 and (c < dims).all():
                        at = (c[0] * dims[1] + c[1]) * dims[2] + c[2]
                        for m in range(cells[at, 0]):
                            j = cells[at, m + 1]
                            gap = ti.Vector([
                                x[0] - centres[j, 0], x[1] - centres[j, 1], x[2] - centres[j, 2]
                            ])  # fmt: skip
                            if periodic > 0:
                                gap -= side * ti.round(gap / side)
                            if gap.norm_sqr() < 4.0 * radius * radius:
                                free = False
                if free:
                    at = (cell[0] * dims[1] + cell[1]) * dims[2] + cell[2]
                    cells[at, cells[at, 0] + 1] = i
                    cells[at, 0] += 1
                    for k in ti.static(range(3)):
                        centres[i, k] = x[k]
            if free:
                placed += 1
            else:
                stuck = True
    return placed


def sequential_addition(
    count: int, radius: float, low: np.ndarray, high: np.ndarray, seed: int, periodic: bool = False
) -> np.ndarray:
    """Centres, shape (count, 3) in m, of equal spheres of ``radius`` (m) that do not overlap.

    Centres lie anywhere in the box ``low``..``high`` (m); spheres may reach over its faces, and where the box
    is ``periodic`` they do not overlap across them either. Depends on the arguments alone, not on device or
    threads. InputError when the box has no room left.
    """
    runtime.current()
    side = np.asarray(high, float) - np.asarray(low, float)
    must(bool((side > 0).all()), "box", "wider than nothing in each direction", side.tolist())
    # Cells at least a diameter wide, so that overlaps are found in the 27 cells around.
    dims = np.clip(np.floor(side / (2.0 * radius)), 1, CELLS).astype(int)
    wide = np.prod(np.minimum(side / dims / (2.0 * radius), 1e6))
    members = min(count, int(np.ceil(wide)) * PER_CELL)
    cells = np.zeros((int(np.prod(dims)), 1 + members), dtype=np.int32)
    centres = np.zeros((count, 3))
    placed = _add(
        centres,
        cells,
        count,
        radius,
        seed,
        ATTEMPTS,
        *np.asarray(low, float).tolist(),
        *side.tolist(),
        *dims.tolist(),
        periodic,
    )
    if placed < count:
        fraction = count * 4 / 3 * np.pi * radius**3 / np.prod(side)
        raise InputError(
            "volume fraction of a random sequential start must be within reach, about 0.38 at most "
            f"({placed} of {count} spheres were placed); received {fraction:.3f}"
        )
    return centres
