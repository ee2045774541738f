"""Exponential, logarithm and power in f64, by additions, multiplications and divisions only.

Devices without these functions use these versions, which give the same bits on each device. They are rounded
once, from some 65 bits: the error is below 1 unit in the last place over the whole range.
"""

from fractions import Fraction
from math import factorial

from tisim.backend.taichi import ti
from tisim.numerics.double_double import exact_product, exact_sum, series, upper_digits

LN_2 = Fraction(0xB17217F7D1CF79ABC9E3B39803F2F6AF40F343267298B62D8A0D175B8BAAFA2B, 2**256)
"""ln 2 to 256 bits."""
LN_2_UPPER = float(Fraction(int(LN_2 * 2**38), 2**38))
"""ln 2 to 38 bits; its product with a number of up to 2^15 is exact."""
LN_2_LOWER = float(LN_2 - Fraction(LN_2_UPPER))
THIRD = 1.0 / 3.0
THIRD_REST = float(Fraction(1, 3) - Fraction(THIRD))
ARTANH_TAIL = tuple(1.0 / k for k in range(5, 28, 2))
"""Coefficients of artanh(x)/x in x^2, from x^4 on."""
EXP_TAIL = tuple(1.0 / factorial(k) for k in range(2, 15))
"""Coefficients of exp(x), from x^2 on."""
ROOT_HALF_BITS = 0x3FE6A09E667F3BCD
"""The bits of sqrt(1/2)."""
SMALLEST_NORMAL = 2.0**-1022
MOST_EXPONENT = 800.0
"""exp of this number is infinity, and exp of its negative is 0."""
MOST_POWER = 2.0**65
"""Any number other than 1 to this power is infinity or 0."""


@ti.func
def log_parts(x):
    """Return ln x as a sum of two numbers, for a finite x > 0.

    x = m 2^e with m near 1, and ln m = 2 artanh((m - 1)/(m + 1)).
    """
    lift = x < ti.f64(SMALLEST_NORMAL)
    number = ti.bit_cast(ti.select(lift, x * ti.f64(2.0**54), x), ti.i64)
    octave = (number - ti.i64(ROOT_HALF_BITS)) >> ti.i64(52)
    m = ti.bit_cast(number - (octave << ti.i64(52)), ti.f64)
    e = ti.cast(octave, ti.f64) - ti.select(lift, ti.f64(54.0), ti.f64(0.0))
    below, above = m - ti.f64(1.0), m + ti.f64(1.0)
    z = upper_digits(below / above)
    # below = z (m + 1) + left, computed without rounding error, as z and 1 have few digits.
    upper, lower = upper_digits(m), m - upper_digits(m)
    left = ((below - z) - z * upper) - z * lower
    z_rest = left / above
    square, square_rest = z * z, z_rest * (ti.f64(2.0) * z + z_rest)
    third, third_rest = exact_product(square, ti.f64(THIRD))
    third_rest += square * ti.f64(THIRD_REST) + square_rest * ti.f64(THIRD)
    fine = square + square_rest
    third_rest += fine * fine * series(fine, ti.static(ARTANH_TAIL))
    # artanh z = z + z (third + third_rest); the first product is exact.
    share = z * third
    total, rest = exact_sum(z, share)
    rest += z_rest * (ti.f64(1.0) + third) + (z + z_rest) * third_rest
    whole, whole_rest = exact_sum(e * ti.f64(LN_2_UPPER), ti.f64(2.0) * total)
    return whole, whole_rest + (ti.f64(2.0) * rest + e * ti.f64(LN_2_LOWER))


@ti.func
def exp_of_parts(x, rest):
    """Return exp(x + rest) for x between -MOST_EXPONENT and MOST_EXPONENT, and a small rest."""
    k = ti.floor(x * ti.f64(1.0 / float(LN_2)) + ti.f64(0.5))
    r, r_rest = exact_sum(x - k * ti.f64(LN_2_UPPER), rest - k * ti.f64(LN_2_LOWER))
    fine = r + r_rest
    value = ti.f64(1.0) + (r + (r_rest + fine * fine * series(fine, ti.static(EXP_TAIL))))
    # Two factors, as 2^k alone may be out of range although the result is not.
    octaves = ti.cast(k, ti.i64)
    first = octaves >> ti.i64(1)
    for exponent in ti.static(range(2)):
        part = ti.select(ti.i64(exponent) == ti.i64(0), first, octaves - first)
        value *= ti.bit_cast((part + ti.i64(1023)) << ti.i64(52), ti.f64)
    return value


@ti.func
def exp(x):
    """Return e^x; f64."""
    result = ti.cast(x, ti.f64)
    if ti.abs(result) <= ti.f64(ti.math.inf):
        most = ti.f64(MOST_EXPONENT)
        result = exp_of_parts(ti.max(-most, ti.min(result, most)), ti.f64(0.0))
    return result


@ti.func
def log(x):
    """Return ln x, f64: -inf at 0, and NaN below."""
    result = ti.cast(x, ti.f64)
    if result > ti.f64(0.0) and result < ti.f64(ti.math.inf):
        value, rest = log_parts(result)
        result = value + rest
    elif result == ti.f64(0.0):
        result = -ti.f64(ti.math.inf)
    elif result < ti.f64(0.0):
        result = ti.f64(ti.math.nan)
    return result


@ti.func
def pow(x, y):
    """Return x^y, f64, as C and IEEE 754 define it: NaN for x < 0 unless y is an integer."""
    base, power = ti.cast(x, ti.f64), ti.cast(y, ti.f64)
    infinity, zero, result = ti.f64(ti.math.inf), ti.f64(0.0), ti.f64(1.0)
    size, most_power = ti.abs(base), ti.abs(power)
    half = ti.f64(0.5) * power
    whole = ti.floor(power) == power or most_power == infinity
    odd = whole and most_power < infinity and ti.floor(half) != half
    undefined = base < zero and size < infinity and not whole
    if base == ti.f64(1.0) or power == zero:
        result = ti.f64(1.0)
    elif not (size <= infinity and most_power <= infinity) or undefined:
        result = ti.f64(ti.math.nan)
    elif size == zero or not (size < infinity):
        result = ti.select((size == zero) == (power < zero), infinity, zero)
    else:
        bound, most = ti.f64(MOST_POWER), ti.f64(MOST_EXPONENT)
        exponent = ti.max(-bound, ti.min(power, bound))
        logarithm, rest = log_parts(size)
        product, product_rest = exact_product(exponent, logarithm)
        within = ti.max(-most, ti.min(product, most))
        rest = ti.select(within == product, product_rest + exponent * rest, zero)
        result = exp_of_parts(within, rest)
    if odd and (base < zero or (base == zero and ti.f64(1.0) / base < zero)):
        result = -result
    return result
