"""Regular solid harmonics: the polynomials that satisfy Laplace's equation.

In spherical coordinates R_nm = r^n P_nm(cos theta) exp(i m phi) / (n + m)!, with P_nm > 0 at small theta. A
harmonic polynomial of degree p is a sum of their real and imaginary parts, in the order of n and m:

    sum over n <= p and m <= n of a_nm Re R_nm + b_nm Im R_nm

With these factors, derivatives only shift the indices (E. W. Hobson, The Theory of Spherical and Ellipsoidal
Harmonics, 1931, chapter 4). With A = a + i b, the derivatives have the coefficients

    along x: A_(n+1)(m+1) / 2 - k A_(n+1)(m-1);   along y: -i (A_(n+1)(m+1) / 2 + k A_(n+1)(m-1));
    along z: A_(n+1)m;    k = 0, 1, 1/2, 1/2, ... for m = 0, 1, 2, 3, ...
"""

import numpy as np

from tisim.backend.taichi import ti


def number(degree: int) -> int:
    """Return the number of real and imaginary parts up to a degree; the imaginary parts of m = 0 are 0."""
    return (degree + 1) * (degree + 2)


def place(n: int, m: int) -> int:
    """Return the place of Re R_nm in the order of all; Im R_nm follows."""
    return n * (n + 1) + 2 * m


def values(points: np.ndarray, degree: int) -> np.ndarray:
    """Return the harmonics up to a degree at points (n, 3), shape (n, number)."""
    x, y, z = points.T
    square, turn = np.einsum("ia,ia->i", points, points), x + 1j * y
    every: dict[tuple[int, int], np.ndarray] = {(0, 0): np.ones(len(points), complex)}
    out = np.zeros((len(points), number(degree)))
    for n in range(degree + 1):
        for m in range(n + 1):
            if n == m > 0:
                every[n, m] = turn * every[n - 1, m - 1] / (2 * n)
            elif n > 0:
                below = every[n - 2, m] if n - 2 >= m else 0.0
                every[n, m] = ((2 * n - 1) * z * every[n - 1, m] - square * below) / (n * n - m * m)
            out[:, place(n, m)], out[:, place(n, m) + 1] = every[n, m].real, every[n, m].imag
    return out


def derivative(axis: int, degree: int) -> np.ndarray:
    """Return the matrix from the coefficients of a polynomial of a degree to the coefficients of its
    derivative along an axis, shape (number(degree - 1), number(degree))."""
    out = np.zeros((number(degree - 1), number(degree)))
    same, turned = np.eye(2), np.array([[0.0, 1.0], [-1.0, 0.0]])
    for n in range(degree):
        for m in range(n + 1):
            row = slice(place(n, m), place(n, m) + 2)
            below = (0.0, 1.0)[m] if m < 2 else 0.5
            terms = {
                0: [(m + 1, 0.5 * same), (m - 1, -below * same)],
                1: [(m + 1, 0.5 * turned), (m - 1, below * turned)],
                2: [(m, same)],
            }[axis]
            for other, block in terms:
                if other >= 0:
                    column = place(n + 1, other)
                    out[row, column : column + 2] = block
            if m == 0:
                out[place(n, 0) + 1] = 0.0
    out[:, [place(n, 0) + 1 for n in range(degree + 1)]] = 0.0
    return out


@ti.func
def basis(r, out: ti.template()):  # type: ignore[valid-type]
    """Set the vector ``out`` to the harmonics at r up to the degree whose number it has."""
    out[0], out[1] = 1.0, 0.0
    square, n, at = r.dot(r), 1, 2
    while at < ti.static(out.n):
        # ``at`` is the place of R_n0; ``one`` and ``two`` of R_(n-1)0 and R_(n-2)0.
        one, two = at - 2 * n, at - 4 * n + 2
        for m in range(n):
            rise, fall = (2.0 * n - 1.0) * r[2] / (n * n - m * m), square / (n * n - m * m)
            for part in ti.static(range(2)):
                k = 2 * m + part
                before = 0.0 * square
                if m < n - 1:
                    before = out[two + k]
                out[at + k] = rise * out[one + k] - fall * before
        real, imaginary, scale = out[one + 2 * n - 2], out[one + 2 * n - 1], 0.5 / n
        out[at + 2 * n] = scale * (r[0] * real - r[1] * imaginary)
        out[at + 2 * n + 1] = scale * (r[0] * imaginary + r[1] * real)
        at += 2 * n + 2
        n += 1


@ti.func
def shifted(a: ti.template(), n, m, axis: ti.template()):  # type: ignore[valid-type]
    """Return the coefficients at (n, m), real and imaginary, of the derivative along an axis of the
    polynomial with the coefficients ``a``, a vector."""
    at = (n + 1) * (n + 2) + 2 * m
    result = ti.Vector([a[at], a[at + 1]])
    if ti.static(axis < 2):
        above, below = 0.5 * ti.Vector([a[at + 2], a[at + 3]]), 0.0 * result
        if m > 0:
            below = ti.select(m == 1, 1.0, 0.5) * ti.Vector([a[at - 2], a[at - 1]])
        if ti.static(axis == 0):
            result = above - below
        else:
            result = ti.Vector([above[1] + below[1], -above[0] - below[0]])
        result[1] = ti.select(m == 0, 0.0, result[1])
    return result
