"""Sums and products of f64 numbers without rounding, each as two numbers.

The first has no more than 26 binary digits, the rest is in the second. So they hold also where a compiler
contracts a product and a sum, or takes (a + b) - a for b, as those for Vulkan do: it cannot see through
digits that are cut off. (T. J. Dekker, Numer. Math. 18 (1971) 224, has them for other compilers.)
"""

from tisim.backend.taichi import ti

LOWER_BITS = 2**27 - 1
"""These are the last 27 of the 53 binary digits of an f64 number."""


@ti.func
def upper_digits(a):
    """Return a number without its last 27 binary digits."""
    return cut(a, LOWER_BITS)


@ti.func
def cut(a, bits: ti.template()):  # type: ignore[valid-type]
    """Return a number without some of its last binary digits."""
    return ti.bit_cast(ti.bit_cast(a, ti.i64) & ~ti.i64(bits), ti.f64)


@ti.func
def exact_sum(a, b):
    """Return a + b; a is the larger one."""
    upper = upper_digits(a + b)
    return upper, (a - upper) + b


@ti.func
def exact_product(a, b):
    """Return a * b to 78 digits; both are below 1e300."""
    upper, upper_a, upper_b = upper_digits(a * b), upper_digits(a), upper_digits(b)
    lower_a, lower_b = a - upper_a, b - upper_b
    # The last digit of the first product is 0, that of the others does not matter. Cut off, no compiler can
    # put the products together again.
    first, second, third = cut(upper_a * upper_b, 1), cut(upper_a * lower_b, 1), cut(lower_a * upper_b, 1)
    return upper, ((first - upper) + second + third) + lower_a * lower_b


@ti.func
def series(x, coefficients: ti.template()):  # type: ignore[valid-type]
    """Return c_0 + x (c_1 + x (c_2 + ...)); f64."""
    total = ti.f64(coefficients[-1])
    for c in ti.static(coefficients[-2::-1]):
        total = total * x + ti.f64(c)
    return total
