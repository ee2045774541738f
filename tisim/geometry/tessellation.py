"""Triangles of shapes, for pictures and exports, and their sharp edges."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from itertools import product

import numpy as np

from tisim.geometry.box import BoxSurface
from tisim.geometry.directions import across
from tisim.geometry.plane import Plane
from tisim.geometry.revolved import RevolvedSurface
from tisim.geometry.shape import Shape
from tisim.geometry.sphere import SphericalSurface
from tisim.geometry.triangles import TriangulatedSurface

FACETS_AROUND = 96
"""Number of facets around an axis."""
SPHERE_RINGS = 48
"""Number of facets between the poles of a sphere."""
FOLD = np.cos(np.radians(15))
"""An edge between two triangles is sharp if the cosine of the angle between their normals is below this."""
BOX_EDGES = [(a, b) for a, b in product(range(8), repeat=2) if a < b and (a ^ b).bit_count() == 1]
"""Pairs of corners of a box, in the order of ``box_corners``, that are the ends of its edges."""
BOX_FACES = (((0, 1, 3, 2), (4, 5, 7, 6)), ((0, 1, 5, 4), (2, 3, 7, 6)), ((0, 2, 6, 4), (1, 3, 7, 5)))
"""Corners of a box around the lower and the upper face normal to each axis."""


@singledispatch
def tessellated(shape: Shape) -> np.ndarray:
    """Return the corners of triangles that approximate the surface of a shape, m, shape (triangles, 3, 3).

    Planes, which are infinite, have none; see ``bounded_planes``.
    """
    raise NotImplementedError(f"{shape.kind()} has no triangles")


@tessellated.register
def _(shape: Plane) -> np.ndarray:
    return np.empty((0, 3, 3))


@tessellated.register
def _(shape: TriangulatedSurface) -> np.ndarray:
    return shape.corners()


@tessellated.register
def _(shape: BoxSurface) -> np.ndarray:
    return box_faces(np.array(shape.low), np.array(shape.high))


@tessellated.register
def _(shape: SphericalSurface) -> np.ndarray:
    return sphere_surface(np.array(shape.centre), shape.radius)


@tessellated.register
def _(shape: RevolvedSurface) -> np.ndarray:
    origin, direction, length, low, high = shape.generator()
    lines = [[(low, 0.0), (high, length)], [(0.0, 0.0), (low, 0.0)], [(0.0, length), (high, length)]]
    axis = np.array(direction) / np.linalg.norm(direction)
    profiles = [np.array(line) for line in lines[: shape.face_count]]
    return np.concatenate([surface_of_revolution(one, np.array(origin), axis) for one in profiles])


def sphere_surface(centre: np.ndarray, radius: float) -> np.ndarray:
    """Return the triangles of a sphere (m)."""
    polar = np.linspace(0, np.pi, SPHERE_RINGS + 1)
    profile = radius * np.stack([np.sin(polar), np.cos(polar)], axis=1)
    # The triangles at the poles share their corner to the last bit.
    profile[[0, -1], 0] = 0.0
    return surface_of_revolution(profile, centre, np.array([0.0, 0.0, 1.0]))


def surface_of_revolution(profile: np.ndarray, origin: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the triangles of a surface of revolution, without those without an area.

    profile : distance from the axis and coordinate along it, m, shape (points, 2).
    """
    angle = 2 * np.pi * np.arange(FACETS_AROUND + 1) / FACETS_AROUND
    a, b = across(axis)
    outward = np.cos(angle)[:, None] * a + np.sin(angle)[:, None] * b
    # The last direction is the first to the last bit, so that no seam is left open.
    outward[-1] = outward[0]
    points = origin + profile[:, None, :1] * outward + profile[:, None, 1:] * axis
    quads = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2)
    corners = quads.reshape(-1, 4, 3)
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    sides = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.asarray(triangles[area > 1e-12 * area.max()])


def box_corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the corners of a box (m), shape (8, 3); the bits of their indices are x, y and z."""
    return np.array(list(product(*zip(low, high, strict=True))))


def box_faces(low: np.ndarray, high: np.ndarray, axes: Sequence[int] = (0, 1, 2)) -> np.ndarray:
    """Return the triangles of the faces of a box (m) that are normal to some axes."""
    corners = box_corners(low, high)
    return np.concatenate([fan(corners[list(face)]) for axis in axes for face in BOX_FACES[axis]])


def fan(polygon: np.ndarray) -> np.ndarray:
    """Return the triangles of a convex polygon, shape (points, 3), from its first point."""
    count = max(0, len(polygon) - 2)
    return np.array([polygon[[0, k + 1, k + 2]] for k in range(count)]).reshape(-1, 3, 3)


def bounded_planes(planes: tuple[Plane, ...], around: np.ndarray) -> list[np.ndarray]:
    """Return the polygon of each plane of a body, m, shape (points, 3): the part within the bounding box of
    some points (m, shape (n, 3)) and in front of the other planes. It has no points if nothing is left."""
    faces = [(np.array(one.point), np.array(one.unit_vector())) for one in planes]
    low, high = around.min(axis=0), around.max(axis=0)
    size, middle = float(np.linalg.norm(high - low)), (low + high) / 2
    bounds = [(low, axis) for axis in np.eye(3)] + [(high, -axis) for axis in np.eye(3)]
    polygons = []
    for k, (point, normal) in enumerate(faces):
        foot, (a, b) = middle - (middle - point) @ normal * normal, across(normal)
        polygon = np.array([foot + size * (x * a + y * b) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        for place, inwards in (*bounds, *(face for m, face in enumerate(faces) if m != k)):
            polygon = _clipped(polygon, (polygon - place) @ inwards + 1e-9 * size)
        polygons.append(polygon)
    return polygons


def _clipped(polygon: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return the part of a polygon in which ``side``, a linear function given at its corners, is positive.

    Source: I. E. Sutherland and G. W. Hodgman, Commun. ACM 17 (1974) 32.
    """
    kept = []
    for k in range(len(polygon)):
        before = k - 1
        if (side[before] > 0) != (side[k] > 0):
            part = side[before] / (side[before] - side[k])
            kept.append(polygon[before] + part * (polygon[k] - polygon[before]))
        if side[k] > 0:
            kept.append(polygon[k])
    return np.array(kept).reshape(-1, 3)


def sharp_edges(triangles: np.ndarray) -> np.ndarray:
    """Return the sides of triangles at rims, and between triangles that are not nearly coplanar, m, shape
    (edges, 2, 3)."""
    if not len(triangles):
        return np.empty((0, 2, 3))
    sides = triangles[:, 1:] - triangles[:, :1]
    normals = np.cross(sides[:, 0], sides[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    points, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 3)
    ends = np.sort(np.concatenate([index[:, [0, 1]], index[:, [1, 2]], index[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(triangles)), 3)
    edges, which, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.ravel(), kind="stable")
    first = np.cumsum(count) - count
    one, other = owner[order][first], owner[order][first + np.minimum(count - 1, 1)]
    flat = (count == 2) & (np.abs((normals[one] * normals[other]).sum(axis=1)) > FOLD)
    return np.asarray(points[edges[~flat]])
