"""Closed forms of single contacts, with only NumPy and SciPy: sliding, adhesion, liquid bridges and beams.

R*, m* and E* are as in ``cases/common/two_spheres.py``. Unless a type says float, arguments may be arrays
that broadcast; SI units.
"""

import numpy as np
from scipy.optimize import brentq

from tisim.cases.common.two_spheres import Numbers


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
