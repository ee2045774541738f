"""tanh(x)/x in kernels, compared with NumPy."""

import numpy as np

from tests.scenes import roundoff
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.tanh import tanh_ratio


@in_taichi_thread
@ti.kernel
def _ratios(x: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(x.shape[0]):
        out[k] = tanh_ratio(x[k])


def test_ratios_are_right_to_rounding_over_all_magnitudes(rng):
    x = np.concatenate([10 ** rng.uniform(-300, 300, 100_000), rng.uniform(0, 3, 100_000)])
    x = np.concatenate([x, [1.0, np.nextafter(1.0, 0.0), 350.0, 800.0]])
    out = np.zeros_like(x)
    _ratios(x, out)
    np.testing.assert_allclose(out, np.tanh(x) / x, rtol=5 * roundoff(), atol=0)
    ends = np.array([0.0, np.inf])
    _ratios(ends, out)
    assert out[:2].tolist() == [1.0, 0.0]
