"""Outlines of walls in pictures: rims and edges of their shapes at their positions at a given time."""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch
from itertools import combinations, product

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from tisim.effects.walls.motion import Fixed, Motion
from tisim.effects.walls.oscillation import Oscillation
from tisim.effects.walls.rotation import Rotation
from tisim.effects.walls.translation import Translation
from tisim.effects.walls.walls import Walls
from tisim.geometry.box import BoxSurface
from tisim.geometry.cone import ConicalSurface
from tisim.geometry.cylinder import CylindricalSurface
from tisim.geometry.directions import across
from tisim.geometry.disc import Disc
from tisim.geometry.plane import Plane
from tisim.geometry.shape import Shape
from tisim.geometry.sphere import SphericalSurface
from tisim.geometry.triangles import TriangulatedSurface
from tisim.scene.scene import Scene

Line = np.ndarray
"""Points of a line, m, shape (n, 3)."""
AROUND = np.linspace(0, 2 * np.pi, 73)
"""Angles of the points of a circle, rad."""
FOLD = np.cos(np.radians(15))
"""An edge between two triangles is drawn if the cosine of the angle between their normals is below this."""
MARGIN = 0.1
"""Planes are drawn this far beyond the bounding box of the grains, relative to its diagonal."""
FAR = 5.0
"""A shape farther away than this, relative to the diagonal, is left out."""


def outlines(scene: Scene, time: float, low: np.ndarray, high: np.ndarray, towards: np.ndarray) -> list[Line]:
    """Return the outlines of the walls of a scene at a time (s), around grains in a box (m).

    towards : direction to the viewer.

    Planes end at other planes of their body, or slightly beyond the box. Bodies whose motion depends on
    forces are left out, because the time does not determine their position; shapes far away are left out too.
    """
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    around = np.array(list(product(*zip(low - MARGIN * size, high + MARGIN * size, strict=True))))
    lines: list[Line] = []
    for walls in (effect for effect in scene.effects if isinstance(effect, Walls)):
        if walls.motion.quantities:
            continue
        # The box and the direction of the viewer in the frame of the body.
        inside = placed(walls.motion, around, -time)
        viewer = placed(walls.motion, np.array([towards, 0 * towards]), -time)
        faces = [(np.array(p.point), np.array(p.normal) / np.linalg.norm(p.normal)) for p in walls.planes]
        own = [line for k in range(len(faces)) for line in _plane(k, faces, inside)]
        shapes = [shape for name, _ in walls.lists() for shape in getattr(walls, name)]
        shapes += [walls.surface] if walls.surface else []
        for shape in shapes:
            own += outline(shape, viewer[0] - viewer[1])
        lines += [placed(walls.motion, line, time) for line in own]
    return [line for line in lines if np.linalg.norm(line - middle, axis=1).max() < FAR * size]


@singledispatch
def placed(motion: Motion, points: np.ndarray, time: float) -> np.ndarray:
    """Return the positions of points of a body (m) at a time (s). With -time, points in space are transformed
    to the frame of the body."""
    raise NotImplementedError(f"where {motion.kind()} has a body is not known from the time")


@placed.register
def _(motion: Fixed, points: np.ndarray, time: float) -> np.ndarray:
    return points


@placed.register
def _(motion: Translation, points: np.ndarray, time: float) -> np.ndarray:
    moving = np.copysign(max(abs(time) - motion.begin, 0.0), time)
    return points + moving * np.array(motion.velocity)


@placed.register
def _(motion: Oscillation, points: np.ndarray, time: float) -> np.ndarray:
    way = np.sin(2 * np.pi * motion.frequency * abs(time) + motion.phase) * np.array(motion.amplitude)
    return points + np.copysign(1.0, time) * way


@placed.register
def _(motion: Rotation, points: np.ndarray, time: float) -> np.ndarray:
    return Turn.from_rotvec(time * np.array(motion.rate)).apply(points - motion.centre) + motion.centre


def _plane(k: int, faces: list[tuple[np.ndarray, np.ndarray]], inside: np.ndarray) -> Iterator[Line]:
    """Yield the outline of plane k of the planes of a body, clipped to the bounding box of some points."""
    point, normal = faces[k]
    low, high = inside.min(axis=0), inside.max(axis=0)
    size, middle = np.linalg.norm(high - low), (low + high) / 2
    foot, (a, b) = middle - (middle - point) @ normal * normal, across(normal)
    polygon = np.array([foot + size * (x * a + y * b) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    bounds = [(low, axis) for axis in np.eye(3)] + [(high, -axis) for axis in np.eye(3)]
    for place, inwards in (*bounds, *(face for m, face in enumerate(faces) if m != k)):
        polygon = _clipped(polygon, (polygon - place) @ inwards + 1e-9 * size)
    if len(polygon) > 2:
        yield np.vstack([polygon, polygon[:1]])


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


@singledispatch
def outline(shape: Shape, towards: np.ndarray) -> list[Line]:
    """Return the rims, edges and silhouette of a shape seen from the direction ``towards``; empty for a
    plane."""
    return []


@outline.register
def _(shape: Plane, towards: np.ndarray) -> list[Line]:
    return []


@outline.register
def _(shape: Disc, towards: np.ndarray) -> list[Line]:
    return [_circle(np.array(shape.centre), np.array(shape.normal), shape.radius)]


@outline.register
def _(shape: SphericalSurface, towards: np.ndarray) -> list[Line]:
    return [_circle(np.array(shape.centre), towards, shape.radius)]


@outline.register
def _(shape: CylindricalSurface, towards: np.ndarray) -> list[Line]:
    return _barrel(np.array(shape.start), np.array(shape.end), (shape.radius, shape.radius), towards)


@outline.register
def _(shape: ConicalSurface, towards: np.ndarray) -> list[Line]:
    radii = (shape.start_radius, shape.end_radius)
    return _barrel(np.array(shape.start), np.array(shape.end), radii, towards)


@outline.register
def _(shape: BoxSurface, towards: np.ndarray) -> list[Line]:
    corners = np.array(list(product(*zip(shape.low, shape.high, strict=True))))
    return [corners[[a, b]] for a, b in combinations(range(8), 2) if (a ^ b).bit_count() == 1]


@outline.register
def _(shape: TriangulatedSurface, towards: np.ndarray) -> list[Line]:
    """Return its rims and edges, except edges between nearly coplanar triangles."""
    corners = shape.corners()
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    at: dict[tuple[bytes, ...], list[int]] = {}
    lines: dict[tuple[bytes, ...], Line] = {}
    for m, triangle in enumerate(corners):
        for ends in (triangle[[0, 1]], triangle[[1, 2]], triangle[[2, 0]]):
            key = tuple(sorted(end.tobytes() for end in ends))
            at.setdefault(key, []).append(m)
            lines[key] = ends
    flat = {key for key, m in at.items() if len(m) == 2 and abs(normals[m[0]] @ normals[m[1]]) > FOLD}
    return [line for key, line in lines.items() if key not in flat]


def _barrel(
    start: np.ndarray, end: np.ndarray, radii: tuple[float, float], towards: np.ndarray
) -> list[Line]:
    """Return the circles at both ends, and the two silhouette lines between them."""
    axis = end - start
    rims = [_circle(at, axis, radius) for at, radius in zip((start, end), radii, strict=True) if radius > 0]
    side = np.cross(axis, towards)
    if (length := np.linalg.norm(side)) == 0:
        return rims
    side /= length
    return rims + [np.array([start + s * radii[0] * side, end + s * radii[1] * side]) for s in (-1, 1)]


def _circle(centre: np.ndarray, normal: np.ndarray, radius: float) -> Line:
    a, b = across(normal / np.linalg.norm(normal))
    return centre + radius * (np.outer(np.cos(AROUND), a) + np.outer(np.sin(AROUND), b))
