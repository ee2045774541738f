"""The blast of Z16 without interaction as a numba program: the peer of tests/benchmarks/blast.py.

The scheme is tisim's ``Trapezoid`` with ``IterationControl``: each particle takes its own adaptive implicit
steps, with magnetic rotation and drag solved exactly in each iteration. One loop over particles runs in
parallel; the state of a particle is kept in registers through a whole window of steps.
"""

from __future__ import annotations

import math
import os
from typing import Any

os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp workqueue tbb")

import numba
import numpy as np

FAST = {"contract", "reassoc", "arcp", "nsz", "afn"}
"""All of fast-math except the assumption that no value is infinite or NaN, because the control tests for
these."""


@numba.njit(fastmath=FAST, error_model="numpy")
def drag(speed, radius, density, viscosity):
    """Chow's g (N s/m) in F = -g v, and the power of the speed to which it is proportional."""
    reynolds = 2.0 * radius * density * speed / viscosity
    c, power = 24.0, 0.0
    if reynolds > 2e6:
        c, power = 0.18 * reynolds, 1.0
    elif reynolds > 3e5:
        c, power = 0.000366 * reynolds**1.4275, 1.4275
    elif reynolds > 400.0:
        c, power = 0.5 * reynolds, 1.0
    elif reynolds > 1.0:
        c, power = 24.0 * reynolds**0.354, 0.354
    return 0.25 * math.pi * viscosity * radius * c, power


@numba.njit(fastmath=FAST, error_model="numpy")
def force(v, q, b, radius, density, viscosity):
    """q v x B - g v."""
    vx, vy, vz = v
    g, _ = drag(math.sqrt(vx * vx + vy * vy + vz * vz), radius, density, viscosity)
    return (
        q * (vy * b[2] - vz * b[1]) - g * vx,
        q * (vz * b[0] - vx * b[2]) - g * vy,
        q * (vx * b[1] - vy * b[0]) - g * vz,
    )


@numba.njit(fastmath=FAST, error_model="numpy")
def iterate(v, v0, f, f0, dt, phi, mass, q, b, radius, density, viscosity):
    """v' of m v' = m v0 + dt (phi (F + J (v' - v)) + (1 - phi) F0), and the force F + J (v' - v)."""
    vx, vy, vz = v
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    g, power = drag(speed, radius, density, viscosity)
    inverse = 1.0 / max(speed, 1e-30)
    ax, ay, az = vx * inverse, vy * inverse, vz * inverse
    gp = g * power
    jxx, jyy, jzz = -g - gp * ax * ax, -g - gp * ay * ay, -g - gp * az * az
    jxy, jyx = q * b[2] - gp * ax * ay, -q * b[2] - gp * ax * ay
    jxz, jzx = -q * b[1] - gp * ax * az, q * b[1] - gp * ax * az
    jyz, jzy = q * b[0] - gp * ay * az, -q * b[0] - gp * ay * az
    h = phi * dt
    jvx = jxx * vx + jxy * vy + jxz * vz
    jvy = jyx * vx + jyy * vy + jyz * vz
    jvz = jzx * vx + jzy * vy + jzz * vz
    sx = mass * v0[0] + dt * (phi * (f[0] - jvx) + (1.0 - phi) * f0[0])
    sy = mass * v0[1] + dt * (phi * (f[1] - jvy) + (1.0 - phi) * f0[1])
    sz = mass * v0[2] + dt * (phi * (f[2] - jvz) + (1.0 - phi) * f0[2])
    # Cramer's rule for (m - phi dt J) v' = s.
    axx, ayy, azz = mass - h * jxx, mass - h * jyy, mass - h * jzz
    axy, axz, ayx, ayz, azx, azy = -h * jxy, -h * jxz, -h * jyx, -h * jyz, -h * jzx, -h * jzy
    cxx, cxy, cxz = ayy * azz - ayz * azy, ayz * azx - ayx * azz, ayx * azy - ayy * azx
    over = 1.0 / (axx * cxx + axy * cxy + axz * cxz)
    nx = over * (cxx * sx + (axz * azy - axy * azz) * sy + (axy * ayz - axz * ayy) * sz)
    ny = over * (cxy * sx + (axx * azz - axz * azx) * sy + (axz * ayx - axx * ayz) * sz)
    nz = over * (cxz * sx + (axy * azx - axx * azy) * sy + (axx * ayy - axy * ayx) * sz)
    dx, dy, dz = nx - vx, ny - vy, nz - vz
    fx = f[0] + jxx * dx + jxy * dy + jxz * dz
    fy = f[1] + jyx * dx + jyy * dy + jyz * dz
    fz = f[2] + jzx * dx + jzy * dy + jzz * dz
    return (nx, ny, nz), (fx, fy, fz)


@numba.njit(fastmath=FAST, error_model="numpy")
def displaced(v, v0, dt, phi):
    """dt (phi v' + (1 - phi) v)."""
    a, b = dt * phi, dt * (1.0 - phi)
    return a * v[0] + b * v0[0], a * v[1] + b * v0[1], a * v[2] + b * v0[2]


@numba.njit(parallel=True, fastmath=FAST, error_model="numpy")
def stretch(r, v, f, own_dt, counts, begins, mass, charge, radius, b, air, control, limit):
    """Advance every particle through windows of steps; adds its steps and iterations to ``counts``."""
    density, viscosity = air
    phi, tolerance, order, first, longest, shortest, most, least = control
    target = tolerance ** (1.0 / (order * limit))
    for i in numba.prange(len(mass)):
        m, q, size = mass[i], charge[i], radius[i]
        ri = (r[i, 0], r[i, 1], r[i, 2])
        vi = (v[i, 0], v[i, 1], v[i, 2])
        fi = (f[i, 0], f[i, 1], f[i, 2])
        dt_next = own_dt[i]
        steps, iterations = 0, 0
        for k_window in range(len(begins) - 1):
            length = begins[k_window + 1] - begins[k_window]
            elapsed, carry = 0.0, 0.0
            while elapsed < length:
                wished = max(shortest, min(dt_next if dt_next > 0.0 else first, longest))
                last = wished * (1.0 + 1e-6) >= length - elapsed
                dt = length - elapsed if last else wished
                v0, f0 = vi, fi
                vk, fk = iterate(v0, v0, f0, f0, dt, phi, m, q, b, size, density, viscosity)
                k, going, accepted = 1, True, False
                while going:
                    fk = force(vk, q, b, size, density, viscosity)
                    new, fk = iterate(vk, v0, fk, f0, dt, phi, m, q, b, size, density, viscosity)
                    k += 1
                    d = displaced(new, v0, dt, phi)
                    moved = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
                    e = (new[0] - vk[0], new[1] - vk[1], new[2] - vk[2])
                    change = phi * dt * math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
                    if change > 0.0:
                        change /= moved
                    vk = new
                    solved = change <= tolerance
                    if solved or k >= limit or not change < np.inf:
                        actual = change ** (1.0 / (order * k))
                        factor = least
                        if target >= least * actual:
                            factor = min(most, target / max(actual, target / most))
                        going, accepted = False, solved
                        if not solved:
                            factor = min(factor, 0.8)
                        dt_next = dt * factor
                iterations += k - 1
                if accepted:
                    d = displaced(vk, v0, dt, phi)
                    ri = (ri[0] + d[0], ri[1] + d[1], ri[2] + d[2])
                    vi, fi = vk, fk
                    step = dt - carry
                    total = elapsed + step
                    carry = (total - elapsed) - step
                    elapsed = length if last else total
                    steps += 1
                    if last:
                        dt_next = max(dt_next, wished)
                elif dt <= shortest:
                    break
        for c in range(3):
            r[i, c], v[i, c], f[i, c] = ri[c], vi[c], fi[c]
        own_dt[i] = dt_next
        counts[i, 0] += steps
        counts[i, 1] += iterations


@numba.njit(fastmath=FAST, error_model="numpy")
def first_forces(v, f, charge, radius, b, air):
    """Forces at the start."""
    for i in range(len(charge)):
        fi = force((v[i, 0], v[i, 1], v[i, 2]), charge[i], b, radius[i], air[0], air[1])
        for c in range(3):
            f[i, c] = fi[c]


def simulate(start: dict[str, Any], b: Any, air: Any, control: Any, limit: int, steps: int, duration: float):
    """Final position and velocity, and steps and iterations of each particle."""
    r, v = start["position"].copy(), start["velocity"].copy()
    f, own_dt = np.zeros_like(v), np.zeros(len(v))
    counts = np.zeros((len(v), 2), np.int64)
    first_forces(v, f, start["charge"], start["radius"], b, air)
    longest = control[4]
    begins = np.append(np.arange(0.0, duration / longest - 1e-6) * longest, duration)
    for k in range(0, len(begins) - 1, steps):
        laws = (start["mass"], start["charge"], start["radius"], b, air, control, limit)
        stretch(r, v, f, own_dt, counts, begins[k : k + steps + 1], *laws)
    return r, v, counts
