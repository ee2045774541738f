"""The scaled complementary error function compared with SciPy."""

import numpy as np
from numpy.polynomial import chebyshev
from scipy import special

from tests.scenes import roundoff
from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.error_function import CHEBYSHEV, erfcx


@in_taichi_thread
@ti.kernel
def _erfcx(x: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(x.shape[0]):
        out[k] = erfcx(x[k])


def test_it_equals_scipy_for_positive_arguments():
    """They agree to rounding for x >= 0, including arguments at which erfc itself underflows."""
    x = np.concatenate([np.linspace(0, 30, 4001), np.logspace(-12, 8, 401)])
    x = x.astype(runtime.current().precision.replace("f", "float"))
    out = np.zeros_like(x)
    _erfcx(x, out)
    np.testing.assert_allclose(out, special.erfcx(x.astype(float)), rtol=10 * roundoff())


def test_the_coefficients_interpolate_the_function():
    def function(u):
        t = (u + 1) / 2
        return special.erfcx(2 / t - 2) / t

    expected = chebyshev.chebinterpolate(function, len(CHEBYSHEV) - 1)
    np.testing.assert_allclose(CHEBYSHEV, expected, rtol=0, atol=2e-14)
