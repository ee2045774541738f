"""Closed forms of single contacts, with only NumPy and SciPy: impacts, friction, adhesion, bridges and beams.

E* is 1 / ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2). R* and m* are 1/(1/R_1 + 1/R_2) and 1/(1/m_1 + 1/m_2); at a
plane they are R and m of the sphere. Unless a type says float, arguments may be arrays that broadcast; SI
units.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import beta

Numbers = np.ndarray | float

HERTZ_DURATION = float(0.8 * beta(0.4, 0.5))
"""The duration of an elastic impact times its speed divided by its depth: 2.943275."""
HERTZ_MEAN_DEPTH = float(0.5 * beta(1.4, 0.5))
"""The force-weighted mean overlap in an elastic impact, divided by the largest overlap: 0.817576."""


def reduced(a: float, b: float = np.inf) -> float:
    """Return 1 / (1/a + 1/b), such as R* and m*; a if b is infinite, as for a plane."""
    return 1.0 / (1.0 / a + 1.0 / b)


def hertz_force(overlap: Numbers, radius: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the force 4/3 E* sqrt(R*) delta^(3/2) (N) at an overlap (m); 0 without overlap."""
    return np.asarray(4 / 3 * modulus * np.sqrt(radius) * np.maximum(overlap, 0.0) ** 1.5)


def hertz_overlap(force: Numbers, radius: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the overlap (m) at which the repulsion is a given force (N)."""
    return np.asarray((3 * np.asarray(force) / (4 * modulus * np.sqrt(radius))) ** (2 / 3))


def hertz_depth(speed: Numbers, radius: Numbers, mass: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the largest overlap (m) of an elastic impact of R* and m* at a relative speed (m/s).

    All of m* v^2 / 2 is then stored in the contact: delta = (15 m* v^2 / (16 E* sqrt(R*)))^(2/5).
    """
    return np.asarray((15 * mass * np.asarray(speed) ** 2 / (16 * modulus * np.sqrt(radius))) ** 0.4)


def hertz_duration(speed: Numbers, radius: Numbers, mass: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the duration (s) of an elastic impact of R* and m* at a relative speed (m/s)."""
    return HERTZ_DURATION * hertz_depth(speed, radius, mass, modulus) / speed


def sliding_impact(
    speed: Numbers, friction: Numbers, restitution: Numbers, lever: Numbers, share: Numbers = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the changes of a solid sphere's velocity (m/s) and spin (rad/s) in an impact with sliding
    throughout.

    They are mu (1 + e) v and 5/2 of that over R, opposite to the sliding.
    speed : approach speed v, m/s. lever : from the centre to the contact, R of a rigid sphere (m).
    share : m*/m, the sphere's share of the velocity change.

    Source: O. R. Walton, in Particulate Two-Phase Flow (1993), chapter 25; Chung and Ooi (2011).
    """
    change = np.asarray(friction * (1 + restitution) * speed * share)
    return change, 2.5 * change / lever


def sliding_limit(friction: float, restitution: float) -> float:
    """Return the ratio of surface to normal speed above which a rigid solid sphere slides throughout its
    impact.

    It is 7/2 mu (1 + e), for an impact with a rigid plane.
    """
    return 3.5 * friction * (1 + restitution)


def dmt_pull_off(energy: float, radius: float) -> float:
    """Return the pull-off force (N) of hard spheres of a surface energy gamma (J/m^2): 4 pi gamma R*."""
    return 4 * np.pi * energy * radius


def jkr_pull_off(energy: float, radius: float) -> float:
    """Return the pull-off force (N) of soft spheres of a surface energy gamma (J/m^2): 3 pi gamma R*."""
    return 3 * np.pi * energy * radius


def jkr_stretch(energy: float, radius: float, modulus: float) -> float:
    """Return the gap (m) at which the contact of soft adhesive spheres ends."""
    return 1.5 * (np.pi * energy / modulus) ** (2 / 3) * (radius / 2) ** (1 / 3)


def jkr_force(overlap: float, energy: float, radius: float, modulus: float) -> float:
    """Return the force (N, < 0 for attraction) of soft adhesive spheres at an overlap (m) of -jkr_stretch or
    more.

    The contact radius a is the root of delta(a) = a^2/R* - 2 sqrt(pi gamma a / E*) on its stable side.

    Source: K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301.
    """

    def beyond(a: float) -> float:
        return a**2 / radius - 2 * np.sqrt(np.pi * energy * a / modulus) - overlap

    # The overlap has its minimum here and grows with the contact radius beyond it.
    least = (np.pi * energy * radius**2 / (4 * modulus)) ** (1 / 3)
    most = np.sqrt(radius * abs(overlap)) + 8 * least
    a = float(brentq(beyond, least, 2 * most, xtol=1e-15 * most, rtol=1e-14)) if beyond(least) < 0 else least
    return float(4 * modulus * a**3 / (3 * radius) - 4 * np.sqrt(np.pi * energy * modulus * a**3))


def bridge_force(gap: Numbers, radius: float, tension: float, angle: float, volume: float) -> np.ndarray:
    """Return the attraction (N) of a liquid bridge over a gap (m) between surfaces.

    radius : 2 R*, m. tension : N/m. angle : contact angle, rad. volume : of the liquid, m^3.

    Source: C. D. Willett, M. J. Adams, S. A. Johnson and J. P. K. Seville, Langmuir 16 (2000) 9396, Eq. (12).
    """
    s = np.maximum(gap, 0.0) * np.sqrt(radius / volume)
    return np.asarray(2 * np.pi * radius * tension * np.cos(angle) / (1 + 1.05 * s + 2.5 * s**2))


def bridge_rupture(angle: float, volume: float) -> float:
    """Return the gap (m) at which a liquid bridge ruptures: (1 + theta/2) V^(1/3).

    Source: G. Lian, C. Thornton and M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138.
    """
    return float((1 + angle / 2) * volume ** (1 / 3))


def beam_deflection(load: float, length: float, young: float, second: float) -> float:
    """Return the deflection P L^3 / (3 E I) (m) of a cantilever's end under a load (N) there (Euler and
    Bernoulli).

    second : I, m^4.
    """
    return load * length**3 / (3 * young * second)
