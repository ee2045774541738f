"""Counter-based random numbers: pure functions of (seed, stream, particle, step), so runs repeat.

Philox4x32-10 of J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as easy
as 1, 2, 3", SC11 (2011): ten rounds turn a 128-bit counter and a 64-bit key into 128 random bits. Nothing
is stored and nothing is shared between threads, so the number of threads cannot matter.
"""

from math import factorial, log, pi, sqrt

from tisim.backend.taichi import ti
from tisim.numerics import elementary

PHILOX_ROUNDS = 10
"""Number of mixing rounds of Philox4x32-10."""
Words = ti.types.vector(4, ti.u32)


@ti.func
def _high(product):
    return ti.cast(product >> ti.u64(32), ti.u32)


@ti.func
def philox(counter, key_low, key_high):
    """Return four random 32-bit words of a counter of four 32-bit words and a key of two."""
    c = counter
    k0, k1 = ti.cast(key_low, ti.u32), ti.cast(key_high, ti.u32)
    for _ in ti.static(range(PHILOX_ROUNDS)):
        p0 = ti.cast(c[0], ti.u64) * ti.u64(0xD2511F53)
        p1 = ti.cast(c[2], ti.u64) * ti.u64(0xCD9E8D57)
        c = Words([_high(p1) ^ c[1] ^ k0, ti.cast(p1, ti.u32), _high(p0) ^ c[3] ^ k1, ti.cast(p0, ti.u32)])
        k0 = k0 + ti.u32(0x9E3779B9)
        k1 = k1 + ti.u32(0xBB67AE85)
    return c


@ti.func
def bits(seed, stream, particle, step, draw=0):
    """Return four random words for a particle at a step.

    stream : separates different uses. draw : counts the draws within a step.
    seed and step are 64-bit, the others 32-bit.
    """
    s, n = ti.cast(seed, ti.u64), ti.cast(step, ti.u64)
    counter = Words(
        [
            ti.cast(n, ti.u32),
            ti.cast(n >> ti.u64(32), ti.u32) ^ (ti.cast(draw, ti.u32) << ti.u32(16)),
            ti.cast(particle, ti.u32),
            ti.cast(stream, ti.u32),
        ]
    )
    return philox(counter, ti.cast(s, ti.u32), _high(s))


@ti.func
def uniform(words):
    """Return two numbers in (0, 1) with 53 random bits each, from four words; always f64."""
    first = ti.cast(words[0] >> ti.u32(5), ti.f64) * 67108864.0 + ti.cast(words[1] >> ti.u32(6), ti.f64)
    second = ti.cast(words[2] >> ti.u32(5), ti.f64) * 67108864.0 + ti.cast(words[3] >> ti.u32(6), ti.f64)
    scale = ti.cast(1.0 / 9007199254740992.0, ti.f64)
    # Limited, as the largest number plus half a unit would round up to 1.
    most = ti.cast(9007199254740992.0, ti.f64) - 1.0
    return ti.Vector([ti.min(first + 0.5, most) * scale, ti.min(second + 0.5, most) * scale], dt=ti.f64)


@ti.func
def normal(words):
    """Return two independent standard normal numbers (f64) from four words (Box and Muller 1958)."""
    u = uniform(words)
    size = ti.sqrt(-2.0 * elementary.log(u[0]))
    angle = ti.cast(6.283185307179586, ti.f64) * u[1]
    return ti.Vector([size * elementary.cos(angle), size * elementary.sin(angle)], dt=ti.f64)


LOG_2, QUARTER, ROOT = log(2), pi / 2, sqrt(0.5)
ROOT_BITS = 0x3FE6A09E667F3BCD
"""The bits of ROOT as an f64 number."""
ARTANH = tuple(1 / k for k in range(1, 14, 2))
COSINE = tuple((-1) ** k / factorial(2 * k) for k in range(7))
SINE = tuple((-1) ** k / factorial(2 * k + 1) for k in range(6))
"""Coefficients of the series of artanh(x)/x, cos x and sin(x)/x in x^2."""


@ti.func
def _series(x, coefficients: ti.template()):  # type: ignore[valid-type]
    """Return c_0 + x (c_1 + x (c_2 + ...))."""
    total = ti.cast(coefficients[-1], ti.f64)
    for c in ti.static(coefficients[-2::-1]):
        total = total * x + ti.cast(c, ti.f64)
    return total


@ti.func
def _length(word):
    """Return sqrt(-2 ln u) of u = (word + 1/2)/2^32, the length of a vector of two normal numbers, to some 11
    digits.

    u = m 2^e with m near 1, and ln m = 2 artanh((m - 1)/(m + 1)), which compilers can vectorise.
    """
    number = ti.bit_cast(ti.cast(word, ti.f64) + 0.5, ti.i64)
    e = (number - ti.i64(ROOT_BITS)) >> ti.i64(52)
    m = ti.bit_cast(number - (e << ti.i64(52)), ti.f64)
    z = (m - 1.0) / (m + 1.0)
    octaves = ti.cast(e - ti.i64(32), ti.f64) * ti.cast(LOG_2, ti.f64)
    return ti.sqrt(-2.0 * (octaves + 2.0 * z * _series(z * z, ARTANH)))


@ti.func
def _direction(word):
    """Return a point on the unit circle, to some 11 digits: in the first quadrant by 30 bits, then two signs.

    cos and sin of pi/4 + x are computed by the series in x.
    """
    x = (ti.cast(word >> ti.u32(2), ti.f64) + 0.5) * ti.cast(QUARTER / 2**30, ti.f64)
    x -= ti.cast(QUARTER / 2, ti.f64)
    c = ti.cast(ROOT, ti.f64) * _series(x * x, COSINE)
    s = ti.cast(ROOT, ti.f64) * x * _series(x * x, SINE)
    first, second = 1.0 - ti.cast(word & ti.u32(2), ti.f64), 1.0 - 2.0 * ti.cast(word & ti.u32(1), ti.f64)
    return ti.Vector([first * (c - s), second * (c + s)], dt=ti.f64)


@ti.func
def normals(words):
    """Return four independent standard normal numbers (f64) from four words, of 32 random bits each.

    They cost a fraction of ``normal``. None is larger than 6.8, which one in 1e11 would exceed.
    """
    a, b = _length(words[0]) * _direction(words[1]), _length(words[2]) * _direction(words[3])
    return ti.Vector([a[0], a[1], b[0], b[1]], dt=ti.f64)
