"""Triangulation of mesh polygons."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tisim.geometry.directions import across

MOST_CORNERS = 1000
"""Largest number of corners of a polygon; the time of triangulation grows with its cube."""


def triangulated(vertices: np.ndarray, polygons: Sequence[Sequence[int]]) -> np.ndarray:
    """Return the triangles of polygons as indices of vertices (m, shape (n, 3)), shape (triangles, 3).

    Polygons need not be convex. A polygon that is not flat is triangulated in its mean plane.
    """
    triangles: list[list[int]] = []
    for polygon in polygons:
        triangles += [list(polygon)] if len(polygon) == 3 else _ears(vertices, list(polygon))
    return np.array(triangles, int).reshape(-1, 3)


def _ears(vertices: np.ndarray, polygon: list[int]) -> list[list[int]]:
    """Return the triangles of a polygon by ear clipping: corners that contain no other vertex are cut off one
    by one.

    Source: G. H. Meisters, Am. Math. Monthly 82 (1975) 648.
    """
    places = vertices[polygon] - vertices[polygon[0]]
    normal = 0.5 * np.cross(places, np.roll(places, -1, axis=0)).sum(axis=0)
    area = np.linalg.norm(normal)
    flat = places @ np.stack(across(normal / area), axis=1) if area > 0 else places[:, :2]
    ring, cut = list(range(len(polygon))), []
    while len(ring) > 3:
        for k in range(len(ring)):
            ear = ring[k - 1], ring[k], ring[(k + 1) % len(ring)]
            if _is_ear(flat, ear, [m for m in ring if m not in ear]):
                break
        else:
            # There is no ear if sides cross or overlap.
            k, ear = 1, (ring[0], ring[1], ring[2])
        cut.append(ear)
        del ring[k]
    cut.append((ring[0], ring[1], ring[2]))
    return [[polygon[m] for m in ear] for ear in cut]


def _is_ear(flat: np.ndarray, ear: tuple[int, int, int], others: list[int]) -> bool:
    a, b, c = flat[list(ear)]
    if _turn(a, b, c[None])[0] <= 0.0:
        return False
    p = flat[others]
    within = (_turn(a, b, p) >= 0.0) & (_turn(b, c, p) >= 0.0) & (_turn(c, a, p) >= 0.0)
    # A bridge to a hole is traversed in both directions, so several vertices may have the same position.
    same = (p[:, None] == flat[list(ear)]).all(axis=2).any(axis=1)
    return not (within & ~same).any()


def _turn(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return twice the signed areas of triangles a, b, p in a plane, negative if clockwise."""
    areas: np.ndarray = (b[0] - a[0]) * (p[:, 1] - a[1]) - (b[1] - a[1]) * (p[:, 0] - a[0])
    return areas
