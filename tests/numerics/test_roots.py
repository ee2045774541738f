"""Cube roots from estimates, compared with NumPy."""

import numpy as np

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.roots import cube_root


@in_taichi_thread
@ti.kernel
def _cube_roots(x: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(x.shape[0]):
        out[k] = cube_root(x[k])


def test_cube_roots_are_right_to_rounding_over_all_magnitudes(rng):
    x = np.concatenate([10 ** rng.uniform(-300, 300, 100_000), [0.0, 1.0, 8.0, 27.0, 1e-300]])
    out = np.zeros_like(x)
    _cube_roots(x, out)
    np.testing.assert_allclose(out, np.cbrt(x), rtol=5e-16, atol=0)
