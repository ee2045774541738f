"""Regular solid harmonics: values, derivatives and the order of the coefficients."""

import numpy as np
import pytest
from scipy.special import sph_harm_y

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics import solid_harmonics

DEGREE = 7


@in_taichi_thread
@ti.kernel
def _basis(points: ti.types.ndarray(), out: ti.types.ndarray()):
    for i in range(points.shape[0]):
        basis = ti.Vector([0.0] * ti.static(solid_harmonics.number(DEGREE)))
        solid_harmonics.basis(ti.Vector([points[i, 0], points[i, 1], points[i, 2]]), basis)
        for k in range(ti.static(basis.n)):
            out[i, k] = basis[k]


@in_taichi_thread
@ti.kernel
def _shifted(coefficients: ti.types.ndarray(), out: ti.types.ndarray()):
    for _ in range(1):
        a = ti.Vector([0.0] * ti.static(solid_harmonics.number(DEGREE)))
        for k in range(ti.static(a.n)):
            a[k] = coefficients[k]
        for n in range(DEGREE):
            for m in range(n + 1):
                for axis in ti.static(range(3)):
                    one = solid_harmonics.shifted(a, n, m, axis)
                    out[axis, n * (n + 1) + 2 * m], out[axis, n * (n + 1) + 2 * m + 1] = one[0], one[1]


def test_they_are_solid_harmonics(rng):
    """r^n Y_nm of scipy, with other factors and the sign of Condon and Shortley."""
    points = rng.normal(size=(20, 3))
    r, theta = np.linalg.norm(points, axis=1), np.arccos(points[:, 2] / np.linalg.norm(points, axis=1))
    phi = np.arctan2(points[:, 1], points[:, 0])
    ours = solid_harmonics.values(points, DEGREE)
    for n in range(DEGREE + 1):
        for m in range(n + 1):
            k = solid_harmonics.place(n, m)
            expected = r**n * sph_harm_y(n, m, theta, phi) * (-1) ** m
            value = ours[:, k] + 1j * ours[:, k + 1]
            ratio = value[0] / expected[0]
            np.testing.assert_allclose(value, ratio * expected, atol=1e-12)
            assert ratio.real > 0
            assert abs(ratio.imag) < 1e-12 * ratio.real


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_derivatives(axis, rng):
    points, step = rng.normal(size=(20, 3)), 1e-5 * np.eye(3)[axis]
    coefficients = rng.normal(size=solid_harmonics.number(DEGREE))
    up, down = (solid_harmonics.values(points + d, DEGREE) @ coefficients for d in (step, -step))
    matrix = solid_harmonics.derivative(axis, DEGREE)
    exact = solid_harmonics.values(points, DEGREE - 1) @ (matrix @ coefficients)
    np.testing.assert_allclose((up - down) / 2e-5, exact, rtol=1e-6, atol=1e-6)


def test_the_same_in_kernels(rng):
    points, coefficients = rng.normal(size=(20, 3)), rng.normal(size=solid_harmonics.number(DEGREE))
    coefficients[[solid_harmonics.place(n, 0) + 1 for n in range(DEGREE + 1)]] = 0.0
    out = np.zeros((20, solid_harmonics.number(DEGREE)))
    _basis(points, out)
    np.testing.assert_allclose(out, solid_harmonics.values(points, DEGREE), rtol=1e-12, atol=1e-14)
    derivatives = np.zeros((3, solid_harmonics.number(DEGREE - 1)))
    _shifted(coefficients, derivatives)
    for axis in range(3):
        expected = solid_harmonics.derivative(axis, DEGREE) @ coefficients
        np.testing.assert_allclose(derivatives[axis], expected, rtol=0, atol=1e-15)
