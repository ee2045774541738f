"""Powers with an exponent that is compiled in."""

from tisim.backend.taichi import ti
from tisim.numerics import elementary

Exponent = int | float
"""Type of an exponent of an effect. It is an option that is compiled in, the same for a whole batch, and not
a parameter per world."""


@ti.func
def power(x, exponent: ti.template()):  # type: ignore[valid-type]
    """Return x ** exponent for x > 0; an integer exponent uses products, which cost a fraction of a pow."""
    result = x
    if ti.static(float(exponent).is_integer()):
        result = whole_power(x, ti.static(int(exponent)))
    else:
        result = elementary.pow(x, exponent)
    return result


@ti.func
def whole_power(x, exponent: ti.template()):  # type: ignore[valid-type]
    """Return x ** exponent by repeated squaring."""
    square = x
    if ti.static(exponent < 0):
        square = 1.0 / x
    result = square
    if ti.static(exponent == 0):
        result = 1.0 + 0.0 * x
    for bit in ti.static(range(abs(exponent).bit_length())):
        if ti.static(bit > 0):
            square *= square
        # The first factor is assigned: compilers must not have to remove a product with one.
        if ti.static(abs(exponent) >> bit & 1):
            if ti.static(abs(exponent) & ((1 << bit) - 1)):
                result *= square
            else:
                result = square
    return result
