"""Regular solid harmonics: the polynomials that satisfy Laplace's equation.

In spherical coordinates R_lm = r^l P_lm(cos theta) exp(i m phi) / (l + m)!, with P_lm > 0 at small theta. A
harmonic polynomial of degree p is a sum of their real and imaginary parts, in the order of l and m:

    sum over l <= p and m <= l of a_lm Re R_lm + b_lm Im R_lm

With these factors, derivatives only shift the indices (E. W. Hobson, The Theory of Spherical and Ellipsoidal
Harmonics, 1931, chapter 4). With A = a + i b, the derivatives have the coefficients

    along x: A_(l+1)(m+1) / 2 - k A_(l+1)(m-1);   along y: -i (A_(l+1)(m+1) / 2 + k A_(l+1)(m-1));
    along z: A_(l+1)m;    k = 0, 1, 1/2, 1/2, ... for m = 0, 1, 2, 3, ...
"""

import numpy as np

from tisim.backend.taichi import ti


def number(degree: int) -> int:
    """Return the number of real and imaginary parts up to a degree; the imaginary parts of m = 0 are 0."""
    return (degree + 1) * (degree + 2)


def place(l: int, m: int) -> int:  # noqa: E741
    """Return the place of Re R_lm in the order of all; Im R_lm follows."""
    return l * (l + 1) + 2 * m


def values(points: np.ndarray, degree: int) -> np.ndarray:
    """Return the harmonics up to a degree at points (n, 3), shape (n, number)."""
    x, y, z = points.T
    square, turn = np.einsum("ia,ia->i", points, points), x + 1j * y
    every: dict[tuple[int, int], np.ndarray] = {(0, 0): np.ones(len(points), complex)}
    out = np.zeros((len(points), number(degree)))
    for l in range(degree + 1):  # noqa: E741
        for m in range(l + 1):
            if l == m > 0:
                every[l, m] = turn * every[l - 1, m - 1] / (2 * l)
            elif l > 0:
                below = every[l - 2, m] if l - 2 >= m else 0.0
                every[l, m] = ((2 * l - 1) * z * every[l - 1, m] - square * below) / (l * l - m * m)
            out[:, place(l, m)], out[:, place(l, m) + 1] = every[l, m].real, every[l, m].imag
    return out


def derivative(axis: int, degree: int) -> np.ndarray:
    """Return the matrix from the coefficients of a polynomial of a degree to the coefficients of its
    derivative along an axis, shape (number(degree - 1), number(degree))."""
    out = np.zeros((number(degree - 1), number(degree)))
    same, turned = np.eye(2), np.array([[0.0, 1.0], [-1.0, 0.0]])
    for l in range(degree):  # noqa: E741
        for m in range(l + 1):
            row = slice(place(l, m), place(l, m) + 2)
            below = (0.0, 1.0)[m] if m < 2 else 0.5
            terms = {
                0: [(m + 1, 0.5 * same), (m - 1, -below * same)],
                1: [(m + 1, 0.5 * turned), (m - 1, below * turned)],
                2: [(m, same)],
            }[axis]
            for other, block in terms:
                if other >= 0:
                    column = place(l + 1, other)
                    out[row, column : column + 2] = block
            if m == 0:
                out[place(l, 0) + 1] = 0.0
    out[:, [place(l, 0) + 1 for l in range(degree + 1)]] = 0.0  # noqa: E741
    return out


@ti.func
def basis(r, out: ti.template()):  # type: ignore[valid-type]
    """Set the vector ``out`` to the harmonics at r up to the degree whose number it has."""
    out[0], out[1] = 1.0, 0.0
    square, l, at = r.dot(r), 1, 2  # noqa: E741
    while at < ti.static(out.n):
        # ``at`` is the place of R_l0; ``one`` and ``two`` of R_(l-1)0 and R_(l-2)0.
        one, two = at - 2 * l, at - 4 * l + 2
        for m in range(l):
            rise, fall = (2.0 * l - 1.0) * r[2] / (l * l - m * m), square / (l * l - m * m)
            for part in ti.static(range(2)):
                k = 2 * m + part
                before = 0.0 * square
                if m < l - 1:
                    before = out[two + k]
                out[at + k] = rise * out[one + k] - fall * before
        real, imaginary, scale = out[one + 2 * l - 2], out[one + 2 * l - 1], 0.5 / l
        out[at + 2 * l] = scale * (r[0] * real - r[1] * imaginary)
        out[at + 2 * l + 1] = scale * (r[0] * imaginary + r[1] * real)
        at += 2 * l + 2
        l += 1  # noqa: E741


@ti.func
def shifted(a: ti.template(), l, m, axis: ti.template()):  # type: ignore[valid-type]  # noqa: E741
    """Return the coefficients at (l, m), real and imaginary, of the derivative along an axis of the
    polynomial with the coefficients ``a``, a vector."""
    at = (l + 1) * (l + 2) + 2 * m
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
