"""Exponential, logarithm, powers, sine and cosine in kernels, on every device.

The compilers for CPU and CUDA have them in f64. The compiler for Vulkan has none, and uses the functions of
this package, computed in f64 and rounded to the precision in use. Laws must call these in place of ``ti.exp``
and the like, for one number at a time; a law that does not works on CPU and CUDA only.
"""

from typing import Any

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics import circular, exponential

COMPLETE = ("cpu", "cuda")
"""Devices whose compilers have the functions in f64."""

Exponent = int | float
"""Type of an exponent of an effect. It is an option that is compiled in, the same for a whole batch, and not
a parameter per world."""


def choose(own: Any, native: Any) -> Any:
    """Return one of two equivalent functions, for the current device."""
    return native if runtime.current().device in COMPLETE else own


@ti.func
def exp(x):
    """Return e^x."""
    # Assignment to result rounds the value to the type of x.
    result = x
    result = ti.static(choose(exponential.exp, ti.exp))(x)
    return result


@ti.func
def log(x):
    """Return ln x."""
    result = x
    result = ti.static(choose(exponential.log, ti.log))(x)
    return result


@ti.func
def pow(x, y):
    """Return x^y, in the common type of both."""
    result = x * y
    result = ti.static(choose(exponential.pow, ti.pow))(x, y)
    return result


@ti.func
def sin(x):
    """Return sin x."""
    result = x
    result = ti.static(choose(circular.sin, ti.sin))(x)
    return result


@ti.func
def cos(x):
    """Return cos x."""
    result = x
    result = ti.static(choose(circular.cos, ti.cos))(x)
    return result


@ti.func
def power(x, exponent: ti.template()):  # type: ignore[valid-type]
    """Return x ** exponent for x > 0; an integer exponent uses products, which cost a fraction of a pow."""
    result = x
    if ti.static(float(exponent).is_integer()):
        result = whole_power(x, ti.static(int(exponent)))
    else:
        result = pow(x, exponent)
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
