"""Whether loops of kernels end where they should, on a device that may do otherwise.

Mesa's software device for Vulkan ends them early in version 22.3, without a word: after 65535 rounds, and
where threads of a block go through atomic operations unequally often, as it takes their memory barrier for
one of the whole block. From version 25 on it does not.
"""

import numpy as np

from tisim.backend.taichi import ti

COUNTED_THREADS, COUNTED_ROUNDS, LONG_LOOP = 256, 7, 70_000
"""These are the numbers of threads, of rounds in which one of them adds while the others do not, and of
rounds of a long loop."""


def end_where_they_should() -> bool:
    """Return whether loops end where they should."""
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
