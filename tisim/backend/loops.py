"""A test that kernel loops end correctly on a device.

In version 22.3 Mesa's software device for Vulkan silently ends loops early: after 65535 rounds, and if
threads of a block run atomic operations unequally often, because it treats their memory barrier as one of the
whole block. Versions from 25 on are correct.
"""

import numpy as np

from tisim.backend.taichi import ti

COUNTED_THREADS, COUNTED_ROUNDS, LONG_LOOP = 256, 7, 70_000
"""Parameters of the test: number of threads, number of rounds in which one thread adds while the others do
not, and length of the long loop."""


def end_where_they_should() -> bool:
    """Return whether loops end correctly."""
    counts = np.zeros(COUNTED_THREADS, np.int32)
    _count(COUNTED_ROUNDS, LONG_LOOP, counts)
    expected = np.where(np.arange(COUNTED_THREADS) < COUNTED_ROUNDS, 1, 0)
    expected[-1] = LONG_LOOP
    return bool((counts == expected).all())


@ti.kernel
def _count(rounds: ti.i32, long: ti.i32, counts: ti.types.ndarray()):  # type: ignore[valid-type]
    for k in range(COUNTED_THREADS):
        for m in range(rounds * (k == 0)):
            ti.atomic_add(counts[m], 1)
    for _ in range(1):
        for _m in range(long):
            counts[COUNTED_THREADS - 1] = counts[COUNTED_THREADS - 1] + 1
