"""Closed forms of single contacts, by NumPy and SciPy alone: impacts, friction, adhesion, bridges and beams.

E* is 1 / ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2); R* and m* are 1/(1/R_1 + 1/R_2) and alike, which at a plane
are those of the sphere. Unless a type says float, arguments may be arrays that broadcast; SI units.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import beta

Numbers = np.ndarray | float

HERTZ_DURATION = float(0.8 * beta(0.4, 0.5))
"""The time of an elastic impact times its speed over its depth: 2.943275."""
HERTZ_MEAN_DEPTH = float(0.5 * beta(1.4, 0.5))
"""The overlap over the greatest one in an elastic impact, a mean by the force: 0.817576."""


def reduced(a: float, b: float = np.inf) -> float:
    """Return 1 / (1/a + 1/b), such as R* and m*; a where b is infinite, as for a plane."""
    return 1.0 / (1.0 / a + 1.0 / b)


def hertz_force(overlap: Numbers, radius: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the force 4/3 E* sqrt(R*) delta^(3/2) (N) at an overlap (m), 0 where there is none."""
    return np.asarray(4 / 3 * modulus * np.sqrt(radius) * np.maximum(overlap, 0.0) ** 1.5)


def hertz_overlap(force: Numbers, radius: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the overlap (m) at which two push each other apart with a force (N)."""
    return np.asarray((3 * np.asarray(force) / (4 * modulus * np.sqrt(radius))) ** (2 / 3))


def hertz_depth(speed: Numbers, radius: Numbers, mass: Numbers, modulus: Numbers) -> np.ndarray:
    """Return the greatest overlap (m) of an elastic impact of R* and m* at a relative speed (m/s).

    All of m* v^2 / 2 is in the contact then: delta = (15 m* v^2 / (16 E* sqrt(R*)))^(2/5).
    """
    return np.asarray((15 * mass * np.asarray(speed) ** 2 / (16 * modulus * np.sqrt(radius))) ** 0.4)


def hertz_duration(speed: Numbers, radius: Numbers, mass: Numbers, modulus: Numbers) -> np.ndarray:
    """Return how long an elastic impact of R* and m* at a relative speed (m/s) lasts, s."""
    return HERTZ_DURATION * hertz_depth(speed, radius, mass, modulus) / speed


def sliding_impact(
    speed: Numbers, friction: Numbers, restitution: Numbers, lever: Numbers, share: Numbers = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return what a solid sphere's velocity (m/s) and spin (rad/s) change by in an impact through which its
    surface slides: mu (1 + e) v and 5/2 of that over R, against the sliding.

    speed : v at which the two approach, m/s. lever : from the centre to the contact, R of a rigid sphere (m).
    share : m*/m, what the sphere has of the velocity that changes.

    Source: O. R. Walton, in Particulate Two-Phase Flow (1993), chapter 25; Chung and Ooi (2011).
    """
    change = np.asarray(friction * (1 + restitution) * speed * share)
    return change, 2.5 * change / lever


def sliding_limit(friction: float, restitution: float) -> float:
    """Return the surface speed over the normal one beyond which a rigid solid sphere slides through all of
    its impact with a rigid plane: 7/2 mu (1 + e)."""
    return 3.5 * friction * (1 + restitution)


def dmt_pull_off(energy: float, radius: float) -> float:
    """Return the force (N) that parts hard spheres of a surface energy gamma (J/m^2): 4 pi gamma R*."""
    return 4 * np.pi * energy * radius


def jkr_pull_off(energy: float, radius: float) -> float:
    """Return the force (N) that parts soft spheres of a surface energy gamma (J/m^2): 3 pi gamma R*."""
    return 3 * np.pi * energy * radius


def jkr_stretch(energy: float, radius: float, modulus: float) -> float:
    """Return how far soft adhesive spheres stretch before their contact ends, m."""
    return 1.5 * (np.pi * energy / modulus) ** (2 / 3) * (radius / 2) ** (1 / 3)


def jkr_force(overlap: float, energy: float, radius: float, modulus: float) -> float:
    """Return the force (N, < 0 where it pulls) of soft adhesive spheres at an overlap (m) from -jkr_stretch
    on: the root of delta(a) = a^2/R* - 2 sqrt(pi gamma a / E*) on its stable side is looked for.

    Source: K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301.
    """

    def beyond(a: float) -> float:
        return a**2 / radius - 2 * np.sqrt(np.pi * energy * a / modulus) - overlap

    # There the overlap is least, and grows with the circle of contact from there on.
    least = (np.pi * energy * radius**2 / (4 * modulus)) ** (1 / 3)
    most = np.sqrt(radius * abs(overlap)) + 8 * least
    a = float(brentq(beyond, least, 2 * most, xtol=1e-15 * most, rtol=1e-14)) if beyond(least) < 0 else least
    return float(4 * modulus * a**3 / (3 * radius) - 4 * np.sqrt(np.pi * energy * modulus * a**3))


def bridge_force(gap: Numbers, radius: float, tension: float, angle: float, volume: float) -> np.ndarray:
    """Return the pull (N) of a liquid bridge over a gap (m) between surfaces, of 2 R*, with a surface tension
    (N/m), a contact angle (rad) and a volume (m^3).

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
    """Return the deflection P L^3 / (3 E I) (m) of a cantilever's end under a load (N) there: second is I,
    m^4 (Euler and Bernoulli)."""
    return load * length**3 / (3 * young * second)
