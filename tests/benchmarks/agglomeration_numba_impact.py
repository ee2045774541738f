"""The impact of two grains in Z04's flow, written plainly in numba: see agglomeration_numba.py. SI units."""

from typing import NamedTuple

import numpy as np
from numba import njit

GAS = 8.31446261815324  # J/(mol K)
SETTLED, ITERATIONS = 1e-9, 200
OPTIONS = {"error_model": "numpy"}


class Law(NamedTuple):
    """The parameters of a world."""

    hardness: float  # H_0, Pa
    friction: float  # mu
    heat_capacity: float  # C, J/(kg K)
    activation_energy: float  # Q, J/mol
    reaction: float  # alpha, J/m^2
    surface_energy: float  # gamma, J/m^2
    grain_mass: float  # of an original grain, kg


class Grains(NamedTuple):
    """One world's arrays."""

    r: np.ndarray  # (3, capacity), m
    v: np.ndarray  # (3, capacity), m/s
    b: np.ndarray  # radius, m
    m: np.ndarray  # kg; 0 for a grain that has merged into another
    T: np.ndarray  # K
    pieces: np.ndarray  # number of pieces at the end of the step


@njit(**OPTIONS)
def meet(r, v, b, i, j, horizon):
    """Time until the surfaces of two grains meet, s; zero or negative if they have already met.

    inf if they recede, or have a gap of more than ``horizon`` (m).
    """
    dx, dy, dz = r[0, j] - r[0, i], r[1, j] - r[1, i], r[2, j] - r[2, i]
    square, sum_b = dx * dx + dy * dy + dz * dz, b[i] + b[j]
    if square > (sum_b + horizon) ** 2:
        return np.inf
    closing = (v[0, i] - v[0, j]) * dx + (v[1, i] - v[1, j]) * dy + (v[2, i] - v[2, j]) * dz
    if closing <= 0.0:
        return np.inf
    distance = np.sqrt(square)
    return (distance - sum_b) * distance / closing


@njit(**OPTIONS)
def hardness(law, temperature):
    """H = H_0 exp(Q/(R T)), Pa (Z04 section 6); the exponent is bounded, as it overflows for a cold grain."""
    return law.hardness * np.exp(min(law.activation_energy / (GAS * max(temperature, 1e-30)), 80.0))


@njit(**OPTIONS)
def losses(law, e, reduced, vn, vt, small):
    """Tangential impulse (4.17), N s; energy given to each grain (4.7-4.9, 6.9), kinetic energy lost, J."""
    tangential = reduced * vt
    if e > 0.0:
        tangential = min(tangential, law.friction * reduced * vn * (1.0 + e))
    heat = law.reaction * (1.0 - e) * np.pi * small**2 + reduced * vn**2 * (1.0 - e**2) / 3.0
    kinetic = 0.5 * reduced * ((1.0 - e**2) * vn**2 + vt**2 - (vt - tangential / reduced) ** 2)
    return tangential, heat, kinetic


@njit(**OPTIONS)
def collide(law, threshold, g, i, j, counts):
    """Impact of grains i and j (Z04 sections 2-6)."""
    n, slip = g.r[:, j] - g.r[:, i], g.v[:, i] - g.v[:, j]
    n /= np.sqrt((n * n).sum())
    vn = (slip * n).sum()
    slip -= vn * n
    vt = np.sqrt((slip * slip).sum())
    total = g.m[i] + g.m[j]
    reduced, small = g.m[i] * g.m[j] / total, min(g.b[i], g.b[j])
    heat_i, heat_j = g.m[i] * law.heat_capacity, g.m[j] * law.heat_capacity
    # |I_n| = reduced vn (1 + e) / dtau with dtau = 2 b (1 + e) / vn (4.10), in which e cancels.
    force, e = reduced * vn**2 / (2.0 * small), 0.0
    for _ in range(ITERATIONS):
        _, heat, kinetic = losses(law, e, reduced, vn, vt, small)
        hard_i = hardness(law, g.T[i] + (heat + kinetic * g.m[j] / total) / heat_i)
        hard_j = hardness(law, g.T[j] + (heat + kinetic * g.m[i] / total) / heat_j)
        # e = 1 - |I_n| / (2 a H) (3.1) with a = (1 - e) pi b^2 (4.12), so (1 - e)^2 = |I_n| / (2 pi b^2 H).
        new = 1.0 - min(1.0, np.sqrt(force / (2.0 * np.pi * small**2 * min(hard_i, hard_j))))
        change, e = abs(new - e), new
        if change <= SETTLED:
            break

    tangential, heat, kinetic = losses(law, e, reduced, vn, vt, small)
    impulse = reduced * vn * (1.0 + e) * n
    if vt > 0.0:
        impulse += tangential * slip / vt
    g.v[:, i] -= impulse / g.m[i]
    g.v[:, j] += impulse / g.m[j]
    g.T[i] += (heat + kinetic * g.m[j] / total) / heat_i
    g.T[j] += (heat + kinetic * g.m[i] / total) / heat_j
    counts[2] += 1
    counts[4] += breaks(law, threshold, g, i, kinetic * g.m[j] / total)
    counts[4] += breaks(law, threshold, g, j, kinetic * g.m[i] / total)
    if e == 0.0 and g.pieces[i] == 0 and g.pieces[j] == 0:
        share = g.m[j] / total
        g.r[:, i] += share * (g.r[:, j] - g.r[:, i])
        g.v[:, i] += share * (g.v[:, j] - g.v[:, i])
        g.T[i] += share * (g.T[j] - g.T[i])
        g.b[i] = np.cbrt(g.b[i] ** 3 + g.b[j] ** 3)
        g.m[i], g.m[j] = total, 0.0
        counts[3] += 1


@njit(**OPTIONS)
def breaks(law, threshold, g, i, absorbed):
    """Whether the kinetic energy that grain i has absorbed (J) breaks it (Z04 5.1-5.3)."""
    surface = 4.0 * np.pi * law.surface_energy * g.b[i] ** 2
    shrink = absorbed / surface + 1.0
    count = int(min(shrink**3 * (1.0 + 1e-12), np.floor(g.m[i] / law.grain_mass * (1.0 + 1e-6))))
    if shrink * threshold <= 1.0 or count < 2 or g.pieces[i] > 0:
        return 0
    g.pieces[i] = count
    g.T[i] -= surface * (np.cbrt(float(count)) - 1.0) / (g.m[i] * law.heat_capacity)
    return 1


@njit(**OPTIONS)
def rearrange(g, n):
    """Put pieces, in a cubic block about the same centre, for broken grains; remove merged ones."""
    for i in range(n):
        count, g.pieces[i], edge = g.pieces[i], 0, 1
        if count > 0:
            while edge**3 < count:
                edge += 1
            site = np.empty((3, count))
            for k in range(count):
                site[0, k], site[1, k], site[2, k] = k % edge, k // edge % edge, k // edge**2
            middle, centre = site.sum(axis=1) / count, g.r[:, i].copy()
            g.b[i], g.m[i] = g.b[i] / np.cbrt(float(count)), g.m[i] / count
            g.r[:, i] = centre + 2.0 * g.b[i] * (site[:, 0] - middle)
            for k in range(1, count):
                g.v[:, n], g.b[n], g.m[n], g.T[n] = g.v[:, i], g.b[i], g.m[i], g.T[i]
                g.r[:, n] = centre + 2.0 * g.b[i] * (site[:, k] - middle)
                n += 1
    i = 0
    while i < n:
        if g.m[i] > 0.0:
            i += 1
        else:
            n -= 1
            g.r[:, i], g.v[:, i], g.b[i], g.m[i], g.T[i] = g.r[:, n], g.v[:, n], g.b[n], g.m[n], g.T[n]
    return n
