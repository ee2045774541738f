"""The convex hull of particles and their density in it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from tisim.errors import InputError, must

FACETS = 400
"""Number of points that represent a sphere; they lie slightly outside, so that their hull has the volume of
the sphere."""


def hull_volume(position: np.ndarray, radius: np.ndarray | float = 0.0) -> float:
    """Return the volume (m^3) of the convex hull of spheres of a radius (m) at positions (n, 3), m; for
    radius 0, of their centres.

    The hull of centres is exact. Spheres are replaced by polyhedra of equal volume. The result is exact for a
    single sphere. For several, the error is about a thousandth of the difference between the hulls of spheres
    and of centres. InputError is raised for points in a plane.
    """
    r = np.asarray(position, float)
    size = np.broadcast_to(np.asarray(radius, float), len(r))
    must(len(r) > 0, "particles", "at least one", len(r))
    points = r - r.mean(axis=0)
    if size.max() > 0:
        directions = _directions(FACETS)
        outermost = np.concatenate(
            [np.argmax(points @ some.T + size[:, None], axis=0) for some in np.array_split(directions, 8)]
        )
        chosen = np.unique(np.concatenate([outermost, _corners(points)]))
        points = (points[chosen, None] + size[chosen, None, None] * directions).reshape(-1, 3)
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        rule = "spheres, or points not all in a plane"
        raise InputError(f"particles must be {rule}; received points in a plane") from None


def hull_density(position: np.ndarray, mass: np.ndarray, radius: np.ndarray | float = 0.0) -> float:
    """Return the density (kg/m^3) of particles: the sum of masses (kg) over ``hull_volume``.

    L21 uses the hull of "bounding particles", which may mean their centres, ``radius`` 0.

    Source: L21 section 4.2.2.3.
    """
    return float(np.sum(mass) / hull_volume(position, radius))


def _directions(number: int) -> np.ndarray:
    """Return evenly spread points around the origin whose hull has the volume of the unit sphere."""
    k = np.arange(number) + 0.5
    z, turn = 1 - 2 * k / number, np.pi * (3 - np.sqrt(5)) * k
    level = np.sqrt(1 - z**2)
    directions = np.column_stack([level * np.cos(turn), level * np.sin(turn), z])
    return np.asarray(directions * np.cbrt(4 / 3 * np.pi / ConvexHull(directions).volume))


def _corners(points: np.ndarray) -> np.ndarray:
    """Return the indices of points at corners of their hull; all points if they lie in a plane."""
    try:
        return np.asarray(ConvexHull(points).vertices)
    except QhullError:
        return np.arange(len(points))
