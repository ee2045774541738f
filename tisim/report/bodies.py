"""Bodies of a scene beside its particles, as a browser draws them: walls and magnets.

Walls are triangles and the lines of their rims, in m. Magnets and fibres are solid cylinders and spheres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import singledispatch
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.effects.walls.servo import Servo
from tisim.effects.walls.walls import Walls
from tisim.geometry.box import BoxSurface
from tisim.geometry.directions import across
from tisim.geometry.plane import Plane
from tisim.geometry.revolved import RevolvedSurface
from tisim.geometry.shape import Shape
from tisim.geometry.sphere import SphericalSurface
from tisim.geometry.triangles import TriangulatedSurface
from tisim.plotting.walls import FOLD, MARGIN, placed
from tisim.scene.scene import Scene
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.magnets import Magnets

AROUND_AXIS = 64
"""Number of sides that a circle is drawn with."""
AROUND_SPHERE = 24
"""Number of rings of triangles of a sphere."""
COORDINATE_DIGITS = 6
"""Significant digits of coordinates in a report."""


@dataclass
class Mesh:
    """Triangles and lines: vertices (m, shape (n, 3)) and indices of three or two of them, shape (m, 3) and
    (m, 2)."""

    vertices: np.ndarray
    triangles: np.ndarray
    lines: np.ndarray

    @staticmethod
    def joined(parts: Sequence[Mesh]) -> Mesh:
        """Return several meshes as one."""
        begin = np.cumsum([0, *(len(part.vertices) for part in parts)])[:-1]
        shifted = list(zip(parts, begin, strict=True))
        return Mesh(
            np.concatenate([np.empty((0, 3)), *(part.vertices for part in parts)]),
            np.concatenate([np.empty((0, 3), int), *(part.triangles + k for part, k in shifted)]),
            np.concatenate([np.empty((0, 2), int), *(part.lines + k for part, k in shifted)]),
        )


@dataclass
class DrawnBody:
    """A wall.

    name : of its effect. mesh : at the position of the body in its own frame.
    poses : for each frame the translation (m) and the quaternion x, y, z, w from the frame of the body to
        space, shape (frames, 7); empty for a body at rest.
    """

    name: str
    mesh: Mesh
    poses: np.ndarray = field(default_factory=lambda: np.empty((0, 7)))

    def places(self) -> np.ndarray:
        """Return its vertices in space (m) at the first and at the last frame, shape (n, 3)."""
        if not len(self.poses):
            return self.mesh.vertices
        ends = self.poses[[0, -1]]
        turned = [Rotation.from_quat(pose[3:]).apply(self.mesh.vertices) + pose[:3] for pose in ends]
        return np.concatenate(turned)

    def facts(self) -> dict[str, object]:
        """Return it as plain data, with coordinates of COORDINATE_DIGITS digits."""
        return {
            "name": self.name, "vertices": _digits(self.mesh.vertices),
            "triangles": self.mesh.triangles.ravel().tolist(), "lines": self.mesh.lines.ravel().tolist(),
            "poses": _digits(self.poses),
        }  # fmt: skip


@dataclass(frozen=True)
class DrawnMagnet:
    """A solid sphere, or a cylinder with a length and a unit vector along its axis; lengths in m."""

    name: str
    centre: tuple[float, float, float]
    radius: float
    length: float
    axis: tuple[float, float, float]

    def ends(self) -> np.ndarray:
        """Return both ends of its axis (m), shape (2, 3)."""
        half = 0.5 * self.length * np.array(self.axis)
        return np.array(self.centre) + np.stack([-half, half])

    def facts(self) -> dict[str, object]:
        """Return it as plain data."""
        return {
            "name": self.name, "centre": self.centre, "radius": self.radius, "length": self.length,
            "axis": self.axis,
        }  # fmt: skip


def _digits(values: np.ndarray) -> list[float]:
    """Return numbers rounded to COORDINATE_DIGITS significant digits, in a row."""
    return [float(f"{value:.{COORDINATE_DIGITS}g}") for value in values.ravel().tolist()]


def magnets(scene: Scene) -> list[DrawnMagnet]:
    """Return the magnets and fibres of a scene."""
    found = []
    for effect in scene.effects:
        for body in effect.bodies() if isinstance(effect, Magnets) else ():
            long = isinstance(body, Cylinder)
            length, axis = (body.length, body.direction) if long else (0.0, (0.0, 0.0, 1.0))
            found.append(DrawnMagnet(effect.label, body.centre, body.radius, length, axis))
    return found


def bodies(
    scene: Scene, times: np.ndarray, travel: dict[str, np.ndarray], low: np.ndarray, high: np.ndarray
) -> list[DrawnBody]:
    """Return the walls of a scene at some times (s).

    travel : displacement (m) of each wall with a servo along its direction, by the name of the wall, one for
        each time; a wall without it is drawn in its first position.
    low, high : corners (m) of a box around all particles, within which planes are drawn.
    """
    found = []
    for walls in (effect for effect in scene.effects if isinstance(effect, Walls)):
        parts = [mesh(shape) for name, _ in walls.lists() for shape in getattr(walls, name)]
        parts += [mesh(walls.surface)] if walls.surface else []
        parts += list(_planes(walls.planes, low, high))
        body = DrawnBody(walls.label, Mesh.joined(parts))
        if walls.motion.moves:
            body.poses = _poses(walls, times, travel.get(walls.label))
        found.append(body)
    return found


def _poses(walls: Walls, times: np.ndarray, travel: np.ndarray | None) -> np.ndarray:
    """Return the pose of a wall at each time, shape (times, 7)."""
    motion, still = walls.motion, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    poses = np.tile(still, (len(times), 1))
    if isinstance(motion, Servo):
        if travel is not None:
            poses[:, :3] = np.nan_to_num(travel)[:, None] * np.array(motion.unit_vector())
        return poses
    if motion.quantities:
        return poses
    for pose, time in zip(poses, times, strict=True):
        origin, *ends = placed(motion, np.vstack([np.zeros(3), np.eye(3)]), float(time))
        pose[:3] = origin
        pose[3:] = Rotation.from_matrix((np.array(ends) - origin).T).as_quat()
    return poses


@singledispatch
def mesh(shape: Shape) -> Mesh:
    """Return a shape as triangles; empty for a plane, which has no ends, and for shapes of users."""
    return Mesh.joined([])


@mesh.register
def _(shape: RevolvedSurface) -> Mesh:
    origin, direction, length, low, high = shape.generator()
    axis = np.array(direction) / np.linalg.norm(direction)
    start = np.array(origin)
    parts = [revolved(start, start + length * axis, low, high, axis)]
    if shape.face_count > 1:
        parts += [
            revolved(place, place, 0.0, radius, axis)
            for place, radius in ((start, low), (start + length * axis, high))
            if radius > 0
        ]
    return Mesh.joined(parts)


@mesh.register
def _(shape: SphericalSurface) -> Mesh:
    polar = np.linspace(0, np.pi, AROUND_SPHERE + 1)
    z, rho = shape.radius * np.cos(polar), shape.radius * np.sin(polar)
    centre, up = np.array(shape.centre), np.array([0.0, 0.0, 1.0])
    rings = [
        revolved(centre + z[k] * up, centre + z[k + 1] * up, rho[k], rho[k + 1], up)
        for k in range(AROUND_SPHERE)
    ]
    whole = Mesh.joined(rings)
    return Mesh(whole.vertices, whole.triangles, np.empty((0, 2), int))


@mesh.register
def _(shape: BoxSurface) -> Mesh:
    corners = np.array(list(product(*zip(shape.low, shape.high, strict=True))))
    quads = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
    triangles = [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]
    lines = [(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b).bit_count() == 1]
    return Mesh(corners, np.array(triangles), np.array(lines))


@mesh.register
def _(shape: TriangulatedSurface) -> Mesh:
    vertices, inverse = np.unique(shape.corners().reshape(-1, 3), axis=0, return_inverse=True)
    triangles = inverse.reshape(-1, 3)
    return Mesh(vertices, triangles, _sharp_edges(vertices, triangles))


def _sharp_edges(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the rims of a surface and its edges at which it folds, as pairs of vertices."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort(edges.T[::-1])
    unique, first, number = np.unique(edges[order], axis=0, return_index=True, return_counts=True)
    one = owner[order[first]]
    other = owner[order[np.minimum(first + 1, len(order) - 1)]]
    flat = (number == 2) & (np.abs((normal[one] * normal[other]).sum(axis=1)) > FOLD)
    sharp: np.ndarray = unique[~flat]
    return sharp


def revolved(
    start: np.ndarray, end: np.ndarray, low: float, high: float, axis: np.ndarray | None = None
) -> Mesh:
    """Return the surface that a line sweeps around an axis, from distance ``low`` at ``start`` to ``high`` at
    ``end`` (all in m), with its rims.

    axis : unit vector along the axis; it is needed if both ends coincide, as for a disc.
    """
    direction = (end - start) / np.linalg.norm(end - start) if axis is None else axis
    a, b = across(direction)
    angle = 2 * np.pi * np.arange(AROUND_AXIS) / AROUND_AXIS
    circle = np.outer(np.cos(angle), a) + np.outer(np.sin(angle), b)
    one, two = np.arange(AROUND_AXIS), (np.arange(AROUND_AXIS) + 1) % AROUND_AXIS
    n = AROUND_AXIS
    triangles = np.concatenate([np.stack([one, two, two + n], 1), np.stack([one, two + n, one + n], 1)])
    rims = [np.stack([one, two], 1) + k for k, radius in ((0, low), (n, high)) if radius > 0]
    vertices = np.concatenate([start + low * circle, end + high * circle])
    return Mesh(vertices, triangles, np.concatenate([np.empty((0, 2), int), *rims]))


def _planes(planes: Sequence[Plane], low: np.ndarray, high: np.ndarray) -> Iterator[Mesh]:
    """Yield each plane of a body as a polygon, cut at its other planes and slightly beyond a box (m)."""
    size, middle = float(np.linalg.norm(high - low)), (low + high) / 2
    low, high = low - MARGIN * size, high + MARGIN * size
    sides = [(low, axis) for axis in np.eye(3)] + [(high, -axis) for axis in np.eye(3)]
    faces = [(np.array(one.point), np.array(one.unit_vector())) for one in planes]
    for k, (point, normal) in enumerate(faces):
        foot, (a, b) = middle - (middle - point) @ normal * normal, across(normal)
        polygon = np.array(
            [foot + 2 * size * (x * a + y * b) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        )
        for place, inwards in (*sides, *(face for m, face in enumerate(faces) if m != k)):
            polygon = _cut(polygon, (polygon - place) @ inwards + 1e-9 * size)
        if len(polygon) > 2:
            n = len(polygon)
            fan = [(0, m, m + 1) for m in range(1, n - 1)]
            yield Mesh(polygon, np.array(fan), np.array([(m, (m + 1) % n) for m in range(n)]))


def _cut(polygon: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return the part of a polygon in which ``side``, a linear function given at its corners, is positive.

    Source: I. E. Sutherland and G. W. Hodgman, Commun. ACM 17 (1974) 32.
    """
    kept = []
    for k in range(len(polygon)):
        if (side[k - 1] > 0) != (side[k] > 0):
            kept.append(
                polygon[k - 1] + side[k - 1] / (side[k - 1] - side[k]) * (polygon[k] - polygon[k - 1])
            )
        if side[k] > 0:
            kept.append(polygon[k])
    return np.array(kept).reshape(-1, 3)
