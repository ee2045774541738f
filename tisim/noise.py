"""Counter-based random numbers: pure functions of (seed, world, particle, step), so runs repeat.

Philox4x32-10 of J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as easy
as 1, 2, 3", SC11 (2011): ten rounds turn a 128-bit counter and a 64-bit key into 128 random bits. Nothing
is stored and nothing is shared between threads, so the number of threads cannot matter.
"""

from __future__ import annotations

from tisim._taichi import ti

ROUNDS = 10
Words = ti.types.vector(4, ti.u32)


@ti.func
def _high(product):
    return ti.cast(product >> ti.u64(32), ti.u32)


@ti.func
def philox(counter, key_low, key_high):
    """Four random 32-bit words of a counter of four 32-bit words and a key of two."""
    c = counter
    k0, k1 = ti.cast(key_low, ti.u32), ti.cast(key_high, ti.u32)
    for _ in ti.static(range(ROUNDS)):
        p0 = ti.cast(c[0], ti.u64) * ti.u64(0xD2511F53)
        p1 = ti.cast(c[2], ti.u64) * ti.u64(0xCD9E8D57)
        c = Words([_high(p1) ^ c[1] ^ k0, ti.cast(p1, ti.u32), _high(p0) ^ c[3] ^ k1, ti.cast(p0, ti.u32)])
        k0 = k0 + ti.u32(0x9E3779B9)
        k1 = k1 + ti.u32(0xBB67AE85)
    return c


@ti.func
def bits(seed, stream, particle, step, draw=0):
    """Four random words for a particle at a step. ``stream`` keeps uses apart; ``draw`` counts within a step.

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
    """Two numbers in (0, 1) with 53 random bits each, from four words. f64 whatever the precision."""
    first = ti.cast(words[0] >> ti.u32(5), ti.f64) * 67108864.0 + ti.cast(words[1] >> ti.u32(6), ti.f64)
    second = ti.cast(words[2] >> ti.u32(5), ti.f64) * 67108864.0 + ti.cast(words[3] >> ti.u32(6), ti.f64)
    scale = ti.cast(1.0 / 9007199254740992.0, ti.f64)
    # Half a unit more than the largest rounds up to 1.
    most = ti.cast(9007199254740992.0, ti.f64) - 1.0
    return ti.Vector([ti.min(first + 0.5, most) * scale, ti.min(second + 0.5, most) * scale], dt=ti.f64)


@ti.func
def normal(words):
    """Two independent standard normal numbers, from four words (Box and Muller 1958). f64."""
    u = uniform(words)
    size = ti.sqrt(-2.0 * ti.log(u[0]))
    angle = ti.cast(6.283185307179586, ti.f64) * u[1]
    return ti.Vector([size * ti.cos(angle), size * ti.sin(angle)], dt=ti.f64)


@ti.func
def normals(words):
    """Four independent standard normal numbers from four words, of 32 random bits each. f64.

    Half the price of ``normal``; none is larger than 6.7, which one in 4e10 should be.
    """
    scale = ti.cast(1.0 / 4294967296.0, ti.f64)
    u = (ti.cast(words, ti.f64) + 0.5) * scale
    turn = ti.cast(6.283185307179586, ti.f64)
    a, b = ti.sqrt(-2.0 * ti.log(u[0])), ti.sqrt(-2.0 * ti.log(u[2]))
    p, q = turn * u[1], turn * u[3]
    return ti.Vector([a * ti.cos(p), a * ti.sin(p), b * ti.cos(q), b * ti.sin(q)], dt=ti.f64)
