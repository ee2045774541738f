"""The near field over all pairs as a numba program, and the rates of roots and multiplications on this
machine.

Structure of arrays: a parallel loop over particles, and in it a loop over the others, which the compiler
vectorises. It is the peer of tests/benchmarks/near_field.py.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable

os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp workqueue tbb")

import numba
import numpy as np

STREAM = 1024
"""Numbers that a thread processes repeatedly, in its level 1 cache, when rates are measured."""


@numba.njit(parallel=True, fastmath=True, error_model="numpy")
def forces(x, y, z, q, a1, a2, fx, fy, fz):
    """F_i = q_i sum_j q_j (a1/d - a2/d^2) n_ij; all of one type."""
    one = x.dtype.type(1)
    for i in numba.prange(len(x)):
        xi, yi, zi = x[i], y[i], z[i]
        ax = ay = az = one - one
        for j in range(len(x)):
            dx, dy, dz = x[j] - xi, y[j] - yi, z[j] - zi
            square = dx * dx + dy * dy + dz * dz
            # Particle i itself adds c times zero.
            square = square if j != i else one
            v = one / np.sqrt(square)
            c = q[j] * v * v * (a1 - a2 * v)
            ax += c * dx
            ay += c * dy
            az += c * dz
        fx[i], fy[i], fz[i] = q[i] * ax, q[i] * ay, q[i] * az


def widest() -> str:
    """The widest vector register with which the compiled loop takes roots."""
    assembly = "\n".join(forces.inspect_asm().values())
    widths = set(re.findall(r"v?r?sqrt\w*p[sd]\s.*%([xyz]mm)", assembly))
    return max(widths, default="none: not vectorised")


@numba.njit(parallel=True, error_model="numpy")
def roots(x, out, repeats):
    """1/sqrt, correctly rounded."""
    one = x.dtype.type(1)
    for thread in numba.prange(len(x)):
        for r in range(repeats):
            shift = x.dtype.type(r)
            for k in range(STREAM):
                out[thread, k] = one / np.sqrt(x[thread, k] + shift)


@numba.njit(parallel=True, fastmath={"contract"}, error_model="numpy")
def products(x, out, repeats):
    """32 multiply-adds each: four polynomials of degree 8."""
    c = x.dtype.type(0.9)
    for thread in numba.prange(len(x)):
        for r in range(repeats):
            shift = x.dtype.type(r)
            for k in range(STREAM):
                y = x[thread, k]
                p = q = u = v = shift
                for _ in range(8):
                    p = p * y + c
                    q = q * y - c
                    u = u * c + y
                    v = v * c - y
                out[thread, k] = p + q + u + v


def rate(kernel: Callable, each: int, real: type, threads: int) -> float:
    """Results per second of all threads, the better of two tries."""
    x = np.random.default_rng(0).uniform(0.1, 1.0, (threads, STREAM)).astype(real)
    out, repeats = np.empty_like(x), 1000
    kernel(x, out, 1)
    best = np.inf
    for _ in range(2):
        began = time.perf_counter()
        kernel(x, out, repeats)
        best = min(best, time.perf_counter() - began)
    return threads * STREAM * repeats * each / best
