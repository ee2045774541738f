"""Sums and products of f64 numbers without rounding, each as a number and what rounding takes from it.

They hold where the compiler neither reorders nor contracts, as tisim has it do (T. J. Dekker, Numer. Math. 18
(1971) 224; D. E. Knuth, The Art of Computer Programming 2, section 4.2.2).
"""

from tisim.backend.taichi import ti

SPLITTER = 2.0**27 + 1.0
"""A product with this number splits an f64 number in two halves of 26 bits."""


@ti.func
def two_sum(a, b):
    """Return a + b, rounded, and the error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@ti.func
def half(a):
    """Return the upper half of the digits of a number below 1e300."""
    c = ti.f64(SPLITTER) * a
    return c - (c - a)


@ti.func
def two_product(a, b):
    """Return a * b, rounded, and the error; both are below 1e300."""
    product, upper_a, upper_b = a * b, half(a), half(b)
    lower_a, lower_b = a - upper_a, b - upper_b
    error = ((upper_a * upper_b - product) + upper_a * lower_b + lower_a * upper_b) + lower_a * lower_b
    return product, error


@ti.func
def series(x, coefficients: ti.template()):  # type: ignore[valid-type]
    """Return c_0 + x (c_1 + x (c_2 + ...)); f64."""
    total = ti.f64(coefficients[-1])
    for c in ti.static(coefficients[-2::-1]):
        total = total * x + ti.f64(c)
    return total
