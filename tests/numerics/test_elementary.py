"""Elementary functions for devices without them, compared with mpmath to two units in the last place."""

import mpmath
import numpy as np
import pytest

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics import circular, exponential

INF, NAN, TINY, LARGE = np.inf, np.nan, 5e-324, 1.7976931348623157e308
ONE = {"exp": exponential.exp, "log": exponential.log, "sin": circular.sin, "cos": circular.cos}
ULPS = 1.0
SUBNORMAL = 2.3e-308
"""Kernels flush smaller numbers to 0."""


@in_taichi_thread
@ti.kernel
def evaluate(
    x: ti.types.ndarray(),
    y: ti.types.ndarray(),
    results: ti.types.ndarray(),  # type: ignore[valid-type]
):
    for i in range(x.shape[0]):
        results[0, i] = exponential.exp(x[i])
        results[1, i] = exponential.log(x[i])
        results[2, i] = circular.sin(x[i])
        results[3, i] = circular.cos(x[i])
        results[4, i] = exponential.pow(x[i], y[i])


def values(x, y=None):
    """The values of the five functions at each x, by name, and of x^y."""
    x = np.array(x, float)
    results = np.empty((5, len(x)))
    evaluate(x, np.array(np.ones(len(x)) if y is None else y, float), results)
    return dict(zip((*ONE, "pow"), results, strict=True))


def ulps(computed, exact):
    """The largest deviation from the true values, in units of the last place."""
    with mpmath.workprec(200):
        units = (mpmath.mpf(float(np.spacing(abs(float(b))))) for b in exact)
        apart = (abs(mpmath.mpf(float(a)) - b) for a, b in zip(computed, exact, strict=True))
        return float(max(a / unit for a, unit in zip(apart, units, strict=True)))


def spread(rng, low, high, n=1500):
    """Random numbers of both signs with exponents uniform between two bounds."""
    return rng.choice([-1.0, 1.0], n) * rng.uniform(1.0, 2.0, n) * 2.0 ** rng.integers(low, high, n)


@pytest.fixture(scope="module")
def arguments():
    """Arguments of each function from its whole range, including the difficult ones."""
    rng = np.random.default_rng(1)
    worst = 6381956970095103.0 * 2.0**797
    turns = np.arange(1, 400) * (np.pi / 2)
    angles = [
        *spread(rng, -40, 1023),
        *rng.uniform(-100, 100, 1500),
        *turns,
        worst,
        2.0**20,
        2.0**20 + 1,
        1e22,
    ]
    return {
        "exp": [*spread(rng, -60, 9), *rng.uniform(-708, 709, 1500), 709.78, -708.3],
        "log": [*abs(spread(rng, -1022, 1023)), *rng.uniform(0.5, 2.0, 1500), *(1 + spread(rng, -52, -2))],
        "sin": angles,
        "cos": angles,
    }


@pytest.mark.parametrize("name", ONE)
def test_functions_are_accurate(name, arguments):
    x = np.array(arguments[name])
    with mpmath.workprec(1300):
        exact = [getattr(mpmath, name)(mpmath.mpf(float(v))) for v in x]
    assert ulps(values(x)[name], exact) < ULPS


def test_powers_are_accurate():
    rng = np.random.default_rng(2)
    x = np.concatenate(
        [abs(spread(rng, -1022, 1023)), rng.uniform(0.1, 10.0, 1500), 1 + spread(rng, -40, -2)]
    )
    y = rng.uniform(-700, 700, len(x)) / np.maximum(abs(np.log(x)), 1e-300)
    y[::3] = rng.choice([1 / 3, -1 / 3, 0.354, 1.4275, 0.5, 2.0, -1.0], len(y[::3]))
    with mpmath.workprec(300):
        exact = [mpmath.mpf(float(a)) ** mpmath.mpf(float(b)) for a, b in zip(x, y, strict=True)]
    within = np.array([SUBNORMAL < float(v) < LARGE for v in exact])
    computed = values(x, y)["pow"]
    assert ulps(computed[within], [v for v, ok in zip(exact, within, strict=True) if ok]) < ULPS


def test_special_values_equal_numpy():
    x = np.array([0.0, -0.0, 1.0, -1.0, INF, -INF, NAN, 800.0, -800.0, 1e300, -1e300, LARGE, 1e-300, -3.0])
    computed = values(x)
    for name in ONE:
        with np.errstate(all="ignore"):
            expected = getattr(np, name)(x)
        finite = np.isfinite(expected)
        np.testing.assert_array_equal(computed[name][~finite], expected[~finite], name)
        np.testing.assert_allclose(computed[name][finite], expected[finite], 2.3e-16, err_msg=name)
        np.testing.assert_array_equal(np.signbit(computed[name][finite]), np.signbit(expected[finite]))


def test_special_values_of_a_power_equal_numpy():
    edges = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        INF,
        -INF,
        NAN,
        2.0,
        -2.0,
        0.5,
        -0.5,
        3.0,
        -3.0,
        1e300,
        1e-300,
        -1e300,
        2.0**53 + 2,
    ]
    x, y = (side.ravel() for side in np.meshgrid(edges, edges))
    with np.errstate(all="ignore"):
        expected = np.power(x, y)
    computed = values(x, y)["pow"]
    np.testing.assert_allclose(computed, expected, 2.3e-16)
    real = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(computed[real]), np.signbit(expected[real]))
