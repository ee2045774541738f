"""Exponential, logarithm, power, sine and cosine in kernels, on every device.

The compilers for CPU and CUDA have them for f64. That for Vulkan has none: there they are the ones of this
package, in f64 whatever the precision, and rounded to it. Laws call these in place of ``ti.exp`` and the
like, of one number at a time; a law that does not works on CPU and CUDA.
"""

from typing import Any

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics import circular, exponential

COMPLETE = ("cpu", "cuda")
"""The compilers for these devices have the functions for f64."""


def choose(own: Any, native: Any) -> Any:
    """Return the function that the device which runs takes, of two that do the same."""
    return native if runtime.current().device in COMPLETE else own


@ti.func
def exp(x):
    """Return e^x."""
    # What is assigned to it is rounded to the type of x.
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
    """Return x^y, of the type that both together have."""
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
