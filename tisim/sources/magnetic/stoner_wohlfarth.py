"""The magnetisation of a saturated cylinder in a uniform field: the model of Stoner and Wohlfarth (B16 6.3).

Plain NumPy to compute input for a scene: ``Cylinder(..., magnetisation=magnetisation(...))``.
"""

from __future__ import annotations

import numpy as np
from scipy.constants import mu_0
from scipy.special import ellipe, ellipk

from tisim.components.component import Vector
from tisim.errors import must


def demagnetising_factor(radius: float, length: float) -> float:
    """Return N of a uniformly magnetised cylinder along its axis, the mean over its volume; (1 - N) / 2
    across it.

    1 - N is the inductance per length of a current sheet of this shape, over the inductance per length of a
    long one: with k^2 = 4 R^2 / (4 R^2 + l^2), 4 / (3 pi k') ((k'/k)^2 (K - E) + E - k) (L. Lorenz, Ann.
    Phys. 243 (1879) 161; H. Nagaoka, J. Coll. Sci. Imp. Univ. Tokyo 27 (1909) 1).

    InputError is raised unless both (m) are above 0.
    """
    must(radius > 0, "radius of a cylinder", "greater than 0", radius)
    must(length > 0, "length of a cylinder", "greater than 0", length)
    diagonal = np.hypot(2 * radius, length)
    k, rest = 2 * radius / diagonal, length / diagonal
    first, second = ellipk(k * k), ellipe(k * k)
    sheet = 4 / (3 * np.pi * rest) * ((rest / k) ** 2 * (first - second) + second - k)
    return float(1 - sheet)


def magnetisation(
    axis: Vector, radius: float, length: float, saturation: float, flux_density: Vector
) -> Vector:
    """Return M (A/m), of size ``saturation``, that minimises shape and Zeeman energy in a uniform field B_0
    (T).

    Per volume, with psi from the axis and alpha the angle of B_0 from it,

        mu_0 M^2 / 4 (1 - 3 N) sin^2(psi) - M B_0 cos(psi - alpha)

    It is the minimum over all psi, so there is no hysteresis. Of two equal minima the one nearer to the
    direction of ``axis`` is taken. Without a field, M of a long cylinder therefore points along ``axis``, and
    M of a flat one in an arbitrary direction across it.

    Source: E. C. Stoner, E. P. Wohlfarth, Phil. Trans. R. Soc. A 240 (1948) 599; B16 section 6.3.

    InputError is raised for an axis of length 0, or a cylinder or saturation that is not above 0.
    """
    size = float(np.linalg.norm(axis))
    must(0 < size < np.inf, "axis of a cylinder", "a direction", axis)
    must(saturation > 0, "saturation magnetisation", "greater than 0", saturation)
    along = np.asarray(axis, dtype=float) / size
    field = np.asarray(flux_density, dtype=float)
    across = field - (field @ along) * along
    if not np.linalg.norm(across) > 0:
        across = np.cross(along, np.cross([1.0, 0.0, 0.0] if abs(along[0]) < 0.9 else [0.0, 1.0, 0.0], along))
    across /= np.linalg.norm(across)
    anisotropy = 0.5 * mu_0 * saturation * (1 - 3 * demagnetising_factor(radius, length))
    psi = _angle(anisotropy, float(field @ along), float(field @ across))
    m = saturation * (np.cos(psi) * along + np.sin(psi) * across)
    return float(m[0]), float(m[1]), float(m[2])


def _angle(anisotropy: float, along: float, across: float) -> float:
    """Return psi that minimises a/2 sin^2(psi) - b_1 cos(psi) - b_2 sin(psi), all in T; b_2 >= 0.

    At stationary points x = tan(psi/2) satisfies b_2 x^4 + 2 (b_1 - a) x^3 + 2 (b_1 + a) x - b_2 = 0.
    """
    roots = np.roots([across, 2 * (along - anisotropy), 0.0, 2 * (along + anisotropy), -across])
    # Not all of these angles are stationary, but the least energy among them is the minimum. They are sorted
    # by their angle from the axis, so that rounding does not choose between two equal minima.
    angles = np.unique([0.0, np.pi / 2, np.pi, *(2 * np.arctan(roots.real))])
    angles = angles[np.argsort(-np.cos(angles), kind="stable")]
    energy = 0.5 * anisotropy * np.sin(angles) ** 2 - along * np.cos(angles) - across * np.sin(angles)
    scale = abs(anisotropy) + abs(along) + abs(across)
    return float(angles[np.flatnonzero(energy <= energy.min() + 1e-13 * scale)[0]])
