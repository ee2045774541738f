"""Bodies of a scene beside its particles, as a browser draws them: walls, containers and magnets.

Walls are triangles and the lines of their rims, in m. Magnets and fibres are solid cylinders and spheres.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.effects.walls.placement import MARGIN, WallBody, placed, placed_container, wall_body
from tisim.effects.walls.servo import Servo
from tisim.geometry.tessellation import bounded_planes, box_corners, fan, sharp_edges, tessellated
from tisim.scene.scene import Scene
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.magnets import Magnets

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
    def of(triangles: np.ndarray, lines: np.ndarray) -> Mesh:
        """Return the mesh of triangles and lines with some corners (m), shape (m, 3, 3) and (k, 2, 3)."""
        corners = np.concatenate([triangles.reshape(-1, 3), lines.reshape(-1, 3)])
        vertices, index = np.unique(corners, axis=0, return_inverse=True)
        first, second = np.split(index.ravel(), [3 * len(triangles)])
        return Mesh(vertices, first.reshape(-1, 3), second.reshape(-1, 2))


@dataclass
class DrawnBody:
    """A wall, or the container of a packing.

    name : of its effect. mesh : at the position of the body in its own frame.
    poses : for each frame the translation (m) and the quaternion x, y, z, w from the frame of the body to
        space, shape (frames, 7); empty for a body at rest.
    stretches : for each frame the factors by which the body is longer along the axes of its frame, before it
        is turned, shape (frames, 3); empty for a rigid body.
    """

    name: str
    mesh: Mesh
    poses: np.ndarray = field(default_factory=lambda: np.empty((0, 7)))
    stretches: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))

    def places(self) -> np.ndarray:
        """Return its vertices in space (m) at the first and at the last frame, shape (n, 3)."""
        if not len(self.poses):
            return self.mesh.vertices
        long = self.stretches[[0, -1]] if len(self.stretches) else np.ones((2, 3))
        ends = zip(self.poses[[0, -1]], long, strict=True)
        turned = [Rotation.from_quat(pose[3:]).apply(by * self.mesh.vertices) + pose[:3] for pose, by in ends]
        return np.concatenate(turned)

    def facts(self) -> dict[str, object]:
        """Return it as plain data, with coordinates of COORDINATE_DIGITS digits."""
        return {
            "name": self.name, "vertices": digits(self.mesh.vertices),
            "triangles": self.mesh.triangles.ravel().tolist(), "lines": self.mesh.lines.ravel().tolist(),
            "poses": digits(self.poses), "stretches": digits(self.stretches),
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


def digits(values: np.ndarray) -> list[float]:
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
    margin = MARGIN * float(np.linalg.norm(high - low))
    box, found = box_corners(low - margin, high + margin), []
    for walls in filter(None, map(wall_body, scene.effects)):
        parts = [tessellated(shape) for shape in walls.shapes]
        parts += [fan(polygon) for polygon in bounded_planes(walls.planes, box)]
        lines = [sharp_edges(part) for part in parts]
        mesh = Mesh.of(
            np.concatenate([np.empty((0, 3, 3)), *parts]), np.concatenate([np.empty((0, 2, 3)), *lines])
        )
        body = DrawnBody(walls.name, mesh)
        if walls.motion.moves:
            body.poses = _poses(walls, times, travel.get(walls.name))
        found.append(body)
    return found


def container(scene: Scene, states: Iterable[Mapping[str, np.ndarray]]) -> DrawnBody | None:
    """Return the container of a packing at the states of frames; None without a container.

    It is drawn as in the last state with bodies. In others it is as much smaller as they are.
    """
    each = [placed_container(scene, state) for state in states]
    known = [one for one in each if one is not None]
    if not known:
        return None
    last = known[-1]
    body = DrawnBody(last.name, Mesh.of(last.triangles, last.edges))
    if not last.fixed:
        low, high = body.mesh.vertices.min(axis=0), body.mesh.vertices.max(axis=0)
        corners = [(one or last).triangles.reshape(-1, 3) for one in each]
        body.stretches = np.array([np.ptp(points, axis=0) / (high - low) for points in corners])
        shift = np.array([points.min(axis=0) for points in corners]) - body.stretches * low
        body.poses = np.column_stack([shift, np.tile([0.0, 0.0, 0.0, 1.0], (len(each), 1))])
    return body


def _poses(walls: WallBody, times: np.ndarray, travel: np.ndarray | None) -> np.ndarray:
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
