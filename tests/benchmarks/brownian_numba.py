"""Brownian spheres in a trap, in numba and NumPy: the peers of the stepper.

``by_blocks``: without interaction, with a counter-based generator and Box and Muller's numbers by series, on
arrays of particles, so that every loop is vectorised. ``by_library``: the same with numba's own random
numbers. ``exact``: Rotne and Prager's matrix filled in numba, factored by LAPACK. ``fast``: the truncated
expansion.
"""
# The legacy normal numbers are the ones that numba draws in parallel loops.
# ruff: noqa: NPY002

import math

import numba
import numpy as np

BLOCK = 256
FAST = {"fastmath": True, "cache": False, "error_model": "numpy"}
ROOT_BITS = np.int64(0x3FE6A09E667F3BCD)
BELOW = np.uint64(0xFFFFFFFF)


@numba.njit(inline="always", **FAST)
def philox(c0, c1, c2, c3, k0, k1):
    """Ten rounds on words kept in 64 bits."""
    for _ in range(10):
        p0 = c0 * np.uint64(0xD2511F53)
        p1 = c2 * np.uint64(0xCD9E8D57)
        c0, c1, c2, c3 = (
            (p1 >> np.uint64(32)) ^ c1 ^ k0,
            p1 & BELOW,
            (p0 >> np.uint64(32)) ^ c3 ^ k1,
            p0 & BELOW,
        )
        k0 = (k0 + np.uint64(0x9E3779B9)) & BELOW
        k1 = (k1 + np.uint64(0xBB67AE85)) & BELOW
    return c0, c1, c2, c3


@numba.njit(parallel=True, **FAST)
def by_library(r, steps, pull, width):
    """``steps`` steps of r += -pull r + width g; r (n, 3), m."""
    for i in numba.prange(len(r)):
        x, y, z = r[i]
        for _ in range(steps):
            x += width * np.random.standard_normal() - pull * x
            y += width * np.random.standard_normal() - pull * y
            z += width * np.random.standard_normal() - pull * z
        r[i] = x, y, z


@numba.njit(parallel=True, **FAST)
def by_blocks(r, steps, pull, width, seed):
    """The same, r (3, n), vectorised over blocks of particles."""
    blocks = -(-r.shape[1] // BLOCK)
    for block in numba.prange(blocks):
        first = block * BLOCK
        n = min(BLOCK, r.shape[1] - first)
        x, y, z = r[0, first : first + n], r[1, first : first + n], r[2, first : first + n]
        number, words = np.empty((2, BLOCK)), np.empty((2, BLOCK), np.uint64)
        bits = number.view(np.int64)
        scaled = np.empty((2, BLOCK))
        back = scaled.view(np.int64)
        for step in range(steps):
            for i in range(n):
                a, b, c, d = philox(
                    np.uint64(step),
                    np.uint64(0),
                    np.uint64(first + i),
                    np.uint64(1),
                    np.uint64(seed),
                    np.uint64(0),
                )
                number[0, i], words[0, i] = np.float64(np.int64(a)) + 0.5, b
                number[1, i], words[1, i] = np.float64(np.int64(c)) + 0.5, d
            for k in range(2):
                for i in range(n):
                    e = (bits[k, i] - ROOT_BITS) >> 52
                    back[k, i] = bits[k, i] - (e << 52)
            for k in range(2):
                for i in range(n):
                    e = (bits[k, i] - ROOT_BITS) >> 52
                    m = scaled[k, i]
                    q = (m - 1.0) / (m + 1.0)
                    p = q * q
                    s = 1 / 3 + p * (1 / 5 + p * (1 / 7 + p * (1 / 9 + p * (1 / 11 + p / 13))))
                    log = 2.0 * q * (1.0 + p * s) + (np.float64(e) - 32.0) * 0.6931471805599453
                    size = width * math.sqrt(-2.0 * log)
                    word = np.int64(words[k, i])
                    t = (np.float64(word >> 2) + 0.5) * 1.4629180792671596e-09 - 0.7853981633974483
                    p = t * t
                    c = 1 - p * (
                        1 / 2
                        - p * (1 / 24 - p * (1 / 720 - p * (1 / 40320 - p * (1 / 3628800 - p / 479001600))))
                    )
                    s = t * (
                        1 - p * (1 / 6 - p * (1 / 120 - p * (1 / 5040 - p * (1 / 362880 - p / 39916800))))
                    )
                    size *= 0.7071067811865476
                    g = size * (1.0 - np.float64(word & 2)) * (c - s)
                    h = size * (1.0 - 2.0 * np.float64(word & 1)) * (c + s)
                    if k == 0:
                        x[i] += g - pull * x[i]
                        y[i] += h - pull * y[i]
                    else:
                        z[i] += g - pull * z[i]


@numba.njit(**FAST)
def fill(r, radius, matrix):
    """Rotne and Prager's matrix over 1/(6 pi eta), equal radii; r (n, 3), matrix (3n, 3n)."""
    n = len(r)
    for i in range(n):
        for j in range(n):
            a, b, dx, dy, dz = 1 / radius, 0.0, 0.0, 0.0, 0.0
            if i != j:
                dx, dy, dz = r[j, 0] - r[i, 0], r[j, 1] - r[i, 1], r[j, 2] - r[i, 2]
                square = dx * dx + dy * dy + dz * dz
                d = math.sqrt(square)
                if d > 2 * radius:
                    a = 0.75 / d * (1 + 2 * radius**2 / (3 * square))
                    b = 0.75 / d * (1 - 2 * radius**2 / square) / square
                else:
                    a = (1 - 9 * d / (32 * radius)) / radius
                    b = 3 * d / (32 * radius**2) / square
            m = matrix
            m[3 * i, 3 * j], m[3 * i + 1, 3 * j + 1], m[3 * i + 2, 3 * j + 2] = (
                a + b * dx * dx,
                a + b * dy * dy,
                a + b * dz * dz,
            )
            m[3 * i, 3 * j + 1] = m[3 * i + 1, 3 * j] = b * dx * dy
            m[3 * i, 3 * j + 2] = m[3 * i + 2, 3 * j] = b * dx * dz
            m[3 * i + 1, 3 * j + 2] = m[3 * i + 2, 3 * j + 1] = b * dy * dz


@numba.njit(parallel=True, **FAST)
def exact(r, steps, radius, pull, width):
    """dr = -pull R D r + width sqrt(R) C g; r (worlds, n, 3). A thread to a world, LAPACK on that thread."""
    worlds, n, _ = r.shape
    for w in numba.prange(worlds):
        matrix, noise = np.empty((3 * n, 3 * n)), np.empty(3 * n)
        for _ in range(steps):
            fill(r[w], radius, matrix)
            factor = np.linalg.cholesky(matrix)
            for k in range(3 * n):
                noise[k] = np.random.standard_normal()
            drift = np.dot(matrix, r[w].copy().reshape(3 * n))
            shift = width * math.sqrt(radius) * np.dot(factor, noise) - pull * radius * drift
            r[w] += shift.reshape(n, 3)


@numba.njit(parallel=True, **FAST)
def fast(r, steps, radius, pull, width):
    """The same by the truncated expansion; r (worlds, 3, n)."""
    worlds, _, n = r.shape
    for w in numba.prange(worlds):
        x, y, z = r[w, 0], r[w, 1], r[w, 2]
        g, total = np.empty((3, n)), np.empty((10, n))
        for _ in range(steps):
            for c in range(3):
                for i in range(n):
                    g[c, i] = np.random.standard_normal()
            traces = 0.0
            for i in range(n):
                s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = s9 = 0.0
                for j in range(n):
                    dx, dy, dz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
                    square = dx * dx + dy * dy + dz * dz + (1.0 if i == j else 0.0)
                    d = math.sqrt(square)
                    far = 0.75 * radius / d
                    a = far * (1 + 2 * radius * radius / (3 * square))
                    b = far * (1 - 2 * radius * radius / square) / square
                    near = d < 2 * radius
                    a = 1 - 9 * d / (32 * radius) if near else a
                    b = 3 / (32 * radius * d) if near else b
                    a, b = (0.0, 0.0) if i == j else (a, b)
                    dot = b * (dx * x[j] + dy * y[j] + dz * z[j])
                    s0 += a * x[j] + dot * dx
                    s1 += a * y[j] + dot * dy
                    s2 += a * z[j] + dot * dz
                    dot = b * (dx * g[0, j] + dy * g[1, j] + dz * g[2, j])
                    s3 += a * g[0, j] + dot * dx
                    s4 += a * g[1, j] + dot * dy
                    s5 += a * g[2, j] + dot * dz
                    mixed = 2 * a * b + b * b * square
                    s6 += a * a + mixed * dx * dx
                    s7 += a * a + mixed * dy * dy
                    s8 += a * a + mixed * dz * dz
                    s9 += 3 * a + b * square
                total[0, i], total[1, i], total[2, i] = s0, s1, s2
                total[3, i], total[4, i], total[5, i] = s3, s4, s5
                total[6, i], total[7, i], total[8, i] = s6, s7, s8
                traces += s9
            eps = traces / (3 * n * (n - 1))
            q = (n - 1) * eps * eps - (n - 2) * eps
            beta = 1 / (1 + math.sqrt(1 - q))
            for c in range(3):
                for i in range(n):
                    kick = (g[c, i] + beta * total[3 + c, i]) / math.sqrt(1 + beta * beta * total[6 + c, i])
                    r[w, c, i] += width * kick - pull * (r[w, c, i] + total[c, i])
