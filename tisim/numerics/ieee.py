"""IEEE 754 behaviour for non-finite numbers and rounding, in both arithmetics.

In fast arithmetic compilers assume that no number is infinite, and regroup sums as if numbers were not
rounded; NaN stays NaN. Vulkan drivers regroup sums in both arithmetics: Mesa's replaces (a + b) - a by b. To
prevent this, the functions here pass a number through integers.
"""

from tisim.backend import runtime
from tisim.backend.taichi import ti

INFINITE_BITS, SIZE_BITS = 0x7FF0000000000000, 0x7FFFFFFFFFFFFFFF
"""The bits of infinity as an f64 number, and the mask of all bits except the sign."""


def far_away() -> float:
    """Return a distance (m) beyond all others, whose square the precision in use can represent."""
    return 1e150 if runtime.current().precision == "f64" else 1e18


def is_fast() -> bool:
    """Return whether fast arithmetic is in use."""
    return runtime.current().arithmetic == "fast"


def regroups() -> bool:
    """Return whether sums may be regrouped as if numbers were not rounded."""
    return is_fast() or runtime.current().device == "vulkan"


@ti.func
def finite(x):
    """Return whether a number is neither infinite nor NaN."""
    return (ti.bit_cast(ti.cast(x, ti.f64), ti.i64) & ti.i64(SIZE_BITS)) < ti.i64(INFINITE_BITS)


@ti.func
def infinity(count):
    """Return infinity (f64).

    count : an integer >= 0 that is read from a field. In fast arithmetic a constant would not work: compilers
    may replace a value known to be infinite by anything.
    """
    number = ti.cast(ti.math.inf, ti.f64)
    if ti.static(is_fast()):
        number = ti.bit_cast(ti.i64(INFINITE_BITS) ^ (ti.cast(count, ti.i64) >> 63), ti.f64)
    return number


@ti.func
def rounded(x, count):
    """Return an f64 number unchanged, but rounded at this point, so that its sum is not regrouped with later
    sums.

    count : an integer >= 0 that is read from a field.
    """
    number = x
    if ti.static(regroups()):
        number = ti.bit_cast(ti.bit_cast(x, ti.i64) ^ (ti.cast(count, ti.i64) >> 63), ti.f64)
    return number


@ti.func
def compensated_sum(total, term, carry, count):
    """Return a sum (f64) with one more term, and its rounding error for the next call (W. Kahan 1965).

    count : see ``rounded``.
    """
    step = term - carry
    new = rounded(total + step, count)
    return new, rounded(new - total, count) - step


@ti.func
def rounded_vector(x, unit):
    """Return three numbers of the precision in use unchanged, but rounded at this point; see ``rounded``.

    unit : a number of that precision between -1 and 1 that is read from a field.
    """
    numbers = x
    if ti.static(regroups() and runtime.current().precision == "f64"):
        # The highest bit of the exponent is set only in numbers from 2 on.
        nothing = (ti.bit_cast(unit, ti.i64) >> 62) & ti.i64(1)
        for k in ti.static(range(3)):
            numbers[k] = ti.bit_cast(ti.bit_cast(x[k], ti.i64) ^ nothing, ti.f64)
    elif ti.static(regroups()):
        nothing = (ti.bit_cast(unit, ti.i32) >> 30) & 1
        for k in ti.static(range(3)):
            numbers[k] = ti.bit_cast(ti.bit_cast(x[k], ti.i32) ^ nothing, ti.f32)
    return numbers


@ti.func
def same(a, b):
    """Return for each of three numbers of the precision in use whether their bits are equal."""
    return ti.Vector([ti.cast(_bits(a[k]) == _bits(b[k]), ti.i32) for k in range(3)])


@ti.func
def _bits(x):
    bits = ti.i64(0)
    if ti.static(runtime.current().precision == "f64"):
        bits = ti.bit_cast(x, ti.i64)
    else:
        bits = ti.cast(ti.bit_cast(x, ti.i32), ti.i64)
    return bits
