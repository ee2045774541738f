"""Polygons of a mesh cut into triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tisim.geometry.directions import across

MOST_CORNERS = 1000
"""A polygon of more corners is refused: to cut one takes a time that grows with their cube."""


def triangulated(vertices: np.ndarray, polygons: Sequence[Sequence[int]]) -> np.ndarray:
    """Return the triangles of polygons, by vertices (m, shape (n, 3)), shape (triangles, 3).

    A polygon that is not convex is cut too; one that is not flat, along its plane in the mean.
    """
    triangles: list[list[int]] = []
    for polygon in polygons:
        triangles += [list(polygon)] if len(polygon) == 3 else _ears(vertices, list(polygon))
    return np.array(triangles, int).reshape(-1, 3)


def _ears(vertices: np.ndarray, polygon: list[int]) -> list[list[int]]:
    """Return the triangles of a polygon: corners with no other vertex in them are cut off, one by one.

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
            # None is left where sides cross or lie in each other.
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
    # A side to a hole goes there and back, so vertices of it may be at one place.
    same = (p[:, None] == flat[list(ear)]).all(axis=2).any(axis=1)
    return not (within & ~same).any()


def _turn(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return twice the areas of triangles a, b, p in a plane, negative where they go clockwise."""
    areas: np.ndarray = (b[0] - a[0]) * (p[:, 1] - a[1]) - (b[1] - a[1]) * (p[:, 0] - a[0])
    return areas
