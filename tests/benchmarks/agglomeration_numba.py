"""Agglomeration in a thermochemically reacting granular flow, written plainly in numba: a peer and a
reference.

The model of T. I. Zohdi, Proc. R. Soc. Lond. A 460 (2004) 3421-3445 (Z04): spheres move in straight lines;
impacts are found on a cell grid, rebuilt in every step, and resolved one after another; bonded grains merge;
overloaded ones break; all radiate. One world per thread, f64, SI units. Choices that Z04 leaves open:

- Restitution e follows from its pressure law as the root of a quadratic; only its coupling to temperature is
  iterated, from e = 0. Friction stops at sticking. Energies are those in the pair's own frame.
- Of simultaneous impacts the one longest overdue (overlap over approach speed, in f32) comes first, of equal
  ones that with the larger sum of indices. An impact that is no longer due at its turn is skipped.
- Cooling is implicit (backward Euler). A grain that leaves the box is moved by the side of the box.
- The time step depends on all approaching pairs that the grid shows. Other pairs are farther apart than
  ``reach`` mean spacings, so a step is at most that distance over twice the fastest speed in the flow's
  frame. Worlds of at most ``small`` grains use all pairs instead.
"""

from typing import NamedTuple

import numpy as np
from agglomeration_numba_impact import OPTIONS, Grains, Law, collide, meet, rearrange
from numba import njit, parallel_chunksize, prange

STEFAN_BOLTZMANN = 5.670374419e-8  # W/(m^2 K^4)
CONTACTS = 8  # capacity for simultaneous contacts, per grain
COUNTS = ("steps", "particle_steps", "impacts", "merges", "fractures")
HALF = tuple((x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1))[13:]  # and itself


class Settings(NamedTuple):
    """Settings of all worlds; times in s, lengths in m, temperature in K."""

    duration: float
    steps: int = 1 << 60
    half_side: float = 0.01
    shortest: float = 1e-6
    longest: float = 1e-3
    emissivity: float = 0.5
    surroundings: float = 300.0
    threshold: float = 2.0 ** (-1.0 / 3.0)
    reach: float = 0.15
    small: int = 48


class Lists(NamedTuple):
    """One world's cells, and its contacts in order."""

    start: np.ndarray
    cell: np.ndarray
    member: np.ndarray
    first: np.ndarray
    second: np.ndarray
    due: np.ndarray  # s


@njit(**OPTIONS)
def enter(lists, b, i, j, since, k):
    """Store contact number k; the larger grain, of equal ones the earlier, comes first (and absorbs the
    other)."""
    first, second, due = lists.first, lists.second, lists.due
    if b[j] > b[i] or (b[j] == b[i] and j < i):
        i, j = j, i
    if k < len(due):
        while k > 0 and (
            due[k - 1] < since or (due[k - 1] == since and first[k - 1] + second[k - 1] < i + j)
        ):
            first[k], second[k], due[k] = first[k - 1], second[k - 1], due[k - 1]
            k -= 1
        first[k], second[k], due[k] = i, j, since


@njit(**OPTIONS)
def survey(g, lists, n, half, horizon, small):
    """Time to the next contact (s) and the number of present ones, listed longest overdue first."""
    r, v, b, start, cell, member = g.r, g.v, g.b, lists.start, lists.cell, lists.member
    soonest, count = np.inf, 0
    if n <= small:
        for i in range(n):
            for j in range(i + 1, n):
                time = meet(r, v, b, i, j, np.inf)
                if time > 0.0:
                    soonest = min(soonest, time)
                else:
                    enter(lists, b, i, j, np.float32(-time), count)
                    count += 1
        return soonest, count
    dims = int(min(np.cbrt(len(start) - 1.0) + 0.5, max(1.0, 2.0 * half / (2.0 * b[:n].max() + horizon))))
    start[: dims**3 + 1] = 0
    for i in range(n):
        c = 0
        for k in range(3):
            c = c * dims + max(0, min(dims - 1, int((r[k, i] + half) * dims / (2.0 * half))))
        cell[i] = c
        start[c] += 1
    for c in range(dims**3):
        start[c + 1] += start[c]
    for i in range(n - 1, -1, -1):
        start[cell[i]] -= 1
        member[start[cell[i]]] = i
    for i in range(n):
        x, y, z = cell[i] // dims**2, cell[i] // dims % dims, cell[i] % dims
        for dx, dy, dz in HALF:
            cx, cy, cz = x + dx, y + dy, z + dz
            if 0 <= cx < dims and 0 <= cy < dims and 0 <= cz < dims:
                c = (cx * dims + cy) * dims + cz
                for p in range(start[c], start[c + 1]):
                    j = member[p]
                    if c != cell[i] or j > i:
                        time = meet(r, v, b, i, j, horizon)
                        if time > 0.0:
                            soonest = min(soonest, time)
                        else:
                            enter(lists, b, i, j, np.float32(-time), count)
                            count += 1
    return soonest, count


@njit(**OPTIONS)
def drift(g, n, dt, law, settings):
    """Straight flight, return into the box, and radiation (Z04 6.20) solved by Newton's method."""
    half = settings.half_side
    for i in range(n):
        for k in range(3):
            g.r[k, i] += dt * g.v[k, i]
            while g.r[k, i] >= half:
                g.r[k, i] -= 2.0 * half
            while g.r[k, i] < -half:
                g.r[k, i] += 2.0 * half
        a = STEFAN_BOLTZMANN * settings.emissivity * dt * 4.0 * np.pi * g.b[i] ** 2
        a /= g.m[i] * law.heat_capacity
        energy, t = g.T[i] + a * settings.surroundings**4, max(g.T[i], settings.surroundings)
        for _ in range(60):
            change = (t + a * t**4 - energy) / (1.0 + 4.0 * a * t**3)
            t -= change
            if abs(change) <= 1e-9 * t:
                break
        g.T[i] = t


@njit(**OPTIONS)
def world(law, settings, g, n, counts):
    """Run one world to its end; returns its number of grains, or -1 if there were too many contacts."""
    capacity, half = g.b.size, settings.half_side
    cells = (2 * int(np.ceil(np.cbrt(float(n))))) ** 3
    index = np.empty((2, capacity), np.int64)
    pair = np.empty((2, CONTACTS * capacity), np.int64)
    due = np.empty(CONTACTS * capacity, np.float32)
    lists = Lists(np.zeros(cells + 1, np.int64), index[0], index[1], pair[0], pair[1], due)
    frame = (g.v[:, :n] * g.m[:n]).sum(axis=1) / g.m[:n].sum()
    time, moved = 0.0, False
    while True:
        horizon = settings.reach * 2.0 * half / np.cbrt(float(n))
        soonest, count = survey(g, lists, n, half, horizon, settings.small)
        if count > len(due):
            return -1
        before = counts[2]
        for c in range(count if moved else 0):
            i, j = lists.first[c], lists.second[c]
            if g.m[i] > 0.0 and g.m[j] > 0.0 and meet(g.r, g.v, g.b, i, j, np.inf) <= 0.0:
                collide(law, settings.threshold, g, i, j, counts)
        moved = counts[2] == before
        if not moved:
            n = rearrange(g, n)
            continue  # to survey again, for the next step only
        if time >= settings.duration or counts[0] >= settings.steps:
            return n
        # A little after the surfaces meet, so that rounding does not decide whether they have met.
        soonest *= 1.0 + 1e-6
        if n > settings.small:
            fastest = 0.0
            for i in range(n):
                x, y, z = g.v[0, i] - frame[0], g.v[1, i] - frame[1], g.v[2, i] - frame[2]
                fastest = max(fastest, np.sqrt(x * x + y * y + z * z))
            soonest = min(soonest, horizon / (2.0 * fastest + 1e-300))
        dt = max(settings.shortest, min(soonest, settings.longest))
        remaining = settings.duration - time
        # A remainder from rounding alone gets no step.
        time, dt = (settings.duration, remaining) if remaining <= dt * (1.0 + 1e-6) else (time + dt, dt)
        counts[0] += 1
        counts[1] += n
        drift(g, n, dt, law, settings)


@njit(parallel=True, **OPTIONS)
def worlds(laws, settings, number, r, v, b, m, T, pieces, counts):
    """All worlds, each on one thread."""
    for w in prange(len(number)):
        p = laws[w]
        law = Law(p[0], p[1], p[2], p[3], p[4], p[5], p[6])
        g = Grains(r[w], v[w], b[w], m[w], T[w], pieces[w])
        number[w] = world(law, settings, g, number[w], counts[w])


def simulate(starts, parameters, duration, **settings):
    """Run one world per start; returns their final arrays, and their counts.

    starts : mappings with position (m), velocity (m/s), shape (n, 3), radius (m), mass (kg), temperature (K),
        shape (n,). parameters : a mapping for each, with the fields of ``Law``. duration : s.
    settings : any other field of ``Settings``. counts : shape (worlds, 5), its columns ``COUNTS``.
    """
    number, both = np.array([len(s["mass"]) for s in starts]), list(zip(starts, parameters, strict=True))
    # Capacity for all original grains, and again for pieces made before merged grains are removed.
    capacity = 2 * max(int(s["mass"].sum() / p["grain_mass"] + 1.5) for s, p in both)
    names = ("position", "velocity", "radius", "mass", "temperature")
    columns = [np.zeros((len(both), *((3,) if k < 2 else ()), capacity)) for k in range(5)]
    for w, s in enumerate(starts):
        for name, column in zip(names, columns, strict=True):
            column[w, ..., : number[w]] = s[name].T
    laws = np.array([[float(p[key]) for key in Law._fields] for p in parameters])
    counts, pieces = np.zeros((len(both), len(COUNTS)), np.int64), np.zeros((len(both), capacity), np.int64)
    with parallel_chunksize(1):
        worlds(laws, Settings(float(duration), **settings), number, *columns, pieces, counts)
    if (number < 0).any():
        raise RuntimeError(f"more than {CONTACTS} contacts per grain in world {int(number.argmin())}")
    pairs = list(zip(names, columns, strict=True))
    finals = [{name: a[w, ..., :n].T.copy() for name, a in pairs} for w, n in enumerate(number)]
    return finals, counts
