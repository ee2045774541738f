"""Sums and products of f64 numbers without rounding, each as two numbers.

The first number has its last 27 bits set to zero; the second has the rest. These formulas stay correct if a
compiler contracts a product and a sum, or replaces (a + b) - a by b, as those for Vulkan do: it cannot see
through truncated digits. (T. J. Dekker, Numer. Math. 18 (1971) 224, has them for other compilers.)
"""

from tisim.backend.taichi import ti

LOWER_BITS = 2**27 - 1
"""The last 27 of the 53 bits of an f64 number."""


@ti.func
def upper_digits(a):
    """Return a number with its last 27 bits set to zero."""
    return cut(a, LOWER_BITS)


@ti.func
def cut(a, bits: ti.template()):  # type: ignore[valid-type]
    """Return a number with some of its last bits set to zero."""
    return ti.bit_cast(ti.bit_cast(a, ti.i64) & ~ti.i64(bits), ti.f64)


@ti.func
def exact_sum(a, b):
    """Return a + b; a must be the larger one."""
    upper = upper_digits(a + b)
    return upper, (a - upper) + b


@ti.func
def exact_product(a, b):
    """Return a * b to 78 bits; both must be below 1e300."""
    upper, upper_a, upper_b = upper_digits(a * b), upper_digits(a), upper_digits(b)
    lower_a, lower_b = a - upper_a, b - upper_b
    # The last bit of the first product is 0, and the last bits of the others do not matter. Truncation keeps
    # compilers from contracting the products.
    first, second, third = cut(upper_a * upper_b, 1), cut(upper_a * lower_b, 1), cut(lower_a * upper_b, 1)
    return upper, ((first - upper) + second + third) + lower_a * lower_b


@ti.func
def series(x, coefficients: ti.template()):  # type: ignore[valid-type]
    """Return c_0 + x (c_1 + x (c_2 + ...)); f64."""
    total = ti.f64(coefficients[-1])
    for c in ti.static(coefficients[-2::-1]):
        total = total * x + ti.f64(c)
    return total
