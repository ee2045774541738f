"""Sine and cosine in f64, by additions and multiplications only.

Devices without these functions use these versions, which give the same bits on each device; the error is
below 1 unit in the last place over the whole range. An argument beyond ``EXACT_TURNS`` is reduced with as
many digits of 2/pi as necessary (M. H. Payne and R. N. Hanek, ACM SIGNUM Newsletter 18 (1983) 19).
"""

from fractions import Fraction
from math import factorial

from tisim.backend.taichi import ti
from tisim.numerics.double_double import exact_product, exact_sum, series, upper_digits

SINE_TAIL = tuple((-1) ** k / factorial(2 * k + 1) for k in range(1, 10))
COSINE_TAIL = tuple((-1) ** k / factorial(2 * k) for k in range(2, 10))
"""SINE_TAIL and COSINE_TAIL are the coefficients of (sin(x) - x)/x^3 and (cos x - 1 + x^2/2)/x^4 in x^2."""
EXACT_TURNS = 2.0**20
"""Up to this argument the product of the number of quarter turns with each of the ``PARTS`` is exact."""
WINDOW = 7
"""Number of 32-bit words in the product of an argument with 2/pi."""


def _arctan_of_inverse(n: int, digits: int) -> int:
    """Return arctan(1/n) in units of 2^-digits."""
    total, power, k = 0, (1 << digits) // n, 1
    while power:
        total, power, k = total + (power // k if k % 4 == 1 else -(power // k)), power // (n * n), k + 2
    return total


DIGITS_OF_PI = 1400
QUARTER_TURN = 2 * (4 * _arctan_of_inverse(5, DIGITS_OF_PI) - _arctan_of_inverse(239, DIGITS_OF_PI))
"""pi/2 in units of 2^-DIGITS_OF_PI (J. Machin 1706)."""
SPARE_WORDS = 2
INVERSE_WORDS = (
    *(0,) * SPARE_WORDS,
    *(
        (((1 << (DIGITS_OF_PI + 1280)) // QUARTER_TURN) >> (1280 - 32 * k)) & 0xFFFFFFFF
        for k in range(1, 31 + WINDOW)
    ),
)
"""The 32-bit words of 2/pi after the binary point, preceded by some words of zeros."""


def _parts() -> tuple[float, ...]:
    """Return pi/2 as a sum: three numbers of 33 bits each, and the rest."""
    parts, left = [], Fraction(QUARTER_TURN, 1 << DIGITS_OF_PI)
    for k in range(1, 4):
        unit = 33 * k - 1
        parts.append(float(Fraction(int(left * 2**unit), 2**unit)))
        left -= Fraction(parts[-1])
    return (*parts, float(left))


PARTS = _parts()
QUARTER_TURN_UPPER = float(Fraction(QUARTER_TURN, 1 << DIGITS_OF_PI))
QUARTER_TURN_LOWER = float(Fraction(QUARTER_TURN, 1 << DIGITS_OF_PI) - Fraction(QUARTER_TURN_UPPER))


@ti.func
def reduced(x):
    """Return x minus the nearest multiple of a quarter turn, as a sum of two numbers, and the number of
    quarter turns modulo 4."""
    n = ti.floor(x * ti.f64(1.0 / QUARTER_TURN_UPPER) + ti.f64(0.5))
    r, rest = x - n * ti.f64(PARTS[0]), ti.f64(0.0)
    for part in ti.static(PARTS[1:]):
        total, left = exact_sum(r, -n * ti.f64(part))
        r, rest = total, rest + left
    return r, rest, ti.cast(n, ti.i32) & 3


@ti.func
def inverse_word(k):
    """Return word k of 2/pi."""
    word = ti.u64(0)
    for place in ti.static(range(len(INVERSE_WORDS))):
        word = ti.select(k == place, ti.u64(INVERSE_WORDS[place]), word)
    return word


@ti.func
def reduced_far(x):
    """Return the same as ``reduced`` for a finite |x| above 2^20.

    |x| = m 2^e with an integer m. Only the words of 2/pi that matter are used: earlier words give whole
    turns.
    """
    number = ti.bit_cast(ti.abs(x), ti.i64)
    m = (number & ti.i64(2**52 - 1)) | ti.i64(2**52)
    turns = ti.cast(number >> ti.i64(52), ti.i32) - 1075 + 32 * SPARE_WORDS - 2
    begin, shift = turns // 32, ti.cast(turns % 32, ti.u64)
    mask, word_digits = ti.u64(2**32 - 1), ti.u64(32)
    lower, upper = ti.cast(m, ti.u64) & mask, ti.cast(m, ti.u64) >> word_digits
    lower, upper = lower << shift, upper << shift
    factor = ti.Vector.zero(ti.u64, 3)
    factor[0], factor[1] = lower & mask, (lower >> word_digits) + (upper & mask)
    factor[2] = upper >> word_digits
    # The words are stored with the last one first.
    words, product = ti.Vector.zero(ti.u64, WINDOW), ti.Vector.zero(ti.u64, WINDOW + 1)
    for place in range(begin + WINDOW):
        for k in ti.static(range(WINDOW - 1, 0, -1)):
            words[k] = words[k - 1]
        words[0] = inverse_word(place)
    for k in ti.static(range(WINDOW)):
        for j in ti.static(range(min(3, WINDOW - k))):
            both = factor[j] * words[k]
            product[k + j] += both & mask
            product[k + j + 1] += both >> word_digits
    for k in ti.static(range(WINDOW)):
        product[k + 1] += product[k] >> word_digits
        product[k] &= mask
    # Two bits of the first word are quarter turns, rounded to the nearest.
    first = ti.cast(product[WINDOW - 1], ti.i64) + ti.i64(2**29)
    n, r = (
        ti.cast(first >> ti.i64(30), ti.i32) & 3,
        ti.cast((first & ti.i64(2**30 - 1)) - ti.i64(2**29), ti.f64),
    )
    r, rest = r * ti.f64(2.0**-30), ti.f64(0.0)
    for k in ti.static(range(1, 4)):
        part = ti.cast(ti.cast(product[WINDOW - 1 - k], ti.i64), ti.f64) * ti.f64(2.0 ** (-30 - 32 * k))
        total, left = exact_sum(r, part)
        r, rest = total, rest + left
    angle, angle_rest = exact_product(r, ti.f64(QUARTER_TURN_UPPER))
    angle_rest += rest * ti.f64(QUARTER_TURN_UPPER) + r * ti.f64(QUARTER_TURN_LOWER)
    sign = ti.select(x < ti.f64(0.0), ti.f64(-1.0), ti.f64(1.0))
    return sign * angle, sign * angle_rest, ti.select(x < ti.f64(0.0), -n, n) & 3


@ti.func
def sine_of_turned(x, quarters):
    """Return sin(x + quarters pi/2)."""
    result = ti.f64(ti.math.nan)
    if ti.abs(x) < ti.f64(ti.math.inf):
        near = ti.abs(x) <= ti.f64(EXACT_TURNS)
        r, rest, n = x, ti.f64(0.0), 0
        if near:
            r, rest, n = reduced(x)
        else:
            r, rest, n = reduced_far(x)
        n = (n + quarters) & 3
        upper = upper_digits(r)
        rest += r - upper
        fine = upper + rest
        square = fine * fine
        if (n & 1) == 0:
            result = upper + (rest + fine * square * series(square, ti.static(SINE_TAIL)))
        else:
            # The square of the upper digits is exact, and so is 1 minus it.
            middle = ti.f64(0.5) * upper * upper
            most = upper_digits(middle)
            lost = (middle - most) + ti.f64(0.5) * rest * (upper + fine)
            result = (ti.f64(1.0) - most) + (square * square * series(square, ti.static(COSINE_TAIL)) - lost)
        if (n & 2) != 0:
            result = -result
    return result


@ti.func
def sin(x):
    """Return sin x; f64."""
    result = ti.cast(x, ti.f64)
    # An argument this small equals its sine, including -0.
    if not (ti.abs(result) < ti.f64(2.0**-27)):
        result = sine_of_turned(result, 0)
    return result


@ti.func
def cos(x):
    """Return cos x; f64."""
    return sine_of_turned(ti.cast(x, ti.f64), 1)
