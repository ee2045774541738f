"""The convex hull of particles and their density in it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from tisim.errors import InputError, must

FACETS = 400
"""A sphere is taken for the hull of so many points on it, a bit outside, so that its volume is right."""


def hull_volume(position: np.ndarray, radius: np.ndarray | float = 0.0) -> float:
    """Return the volume (m^3) of the convex hull of spheres of a radius (m) at positions (n, 3), m; of their
    centres where it is 0.

    That of the centres is exact. Spheres are replaced by polyhedra of their own volume: of one sphere alone
    it is right, and of others to a thousandth or so of what the hull of the spheres has beyond that of their
    centres. InputError is raised for points in a plane.
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

    L21 has the hull of "bounding particles", and so perhaps of their centres, ``radius`` 0.

    Source: L21 section 4.2.2.3.
    """
    return float(np.sum(mass) / hull_volume(position, radius))


def _directions(number: int) -> np.ndarray:
    """Return points around the origin, evenly spread, with a hull of the volume of the unit sphere."""
    k = np.arange(number) + 0.5
    z, turn = 1 - 2 * k / number, np.pi * (3 - np.sqrt(5)) * k
    level = np.sqrt(1 - z**2)
    directions = np.column_stack([level * np.cos(turn), level * np.sin(turn), z])
    return np.asarray(directions * np.cbrt(4 / 3 * np.pi / ConvexHull(directions).volume))


def _corners(points: np.ndarray) -> np.ndarray:
    """Return which points are corners of their hull; all of them where they have none, in a plane."""
    try:
        return np.asarray(ConvexHull(points).vertices)
    except QhullError:
        return np.arange(len(points))
