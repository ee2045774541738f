"""Walls at a given time: the positions of points of bodies, and the triangles of all walls of a scene and of
the container of a packing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache, singledispatch

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from tisim.effects.base import Effect
from tisim.effects.base.effect import SceneParts
from tisim.effects.walls.confinement import confinement, hard_bodies
from tisim.effects.walls.motion import Fixed, Motion
from tisim.effects.walls.oscillation import Oscillation
from tisim.effects.walls.rotation import Rotation
from tisim.effects.walls.servo import Servo
from tisim.effects.walls.translation import Translation
from tisim.effects.walls.walls import Walls
from tisim.geometry.plane import Plane
from tisim.geometry.shape import Shape
from tisim.geometry.tessellation import bounded_planes, box_corners, fan, sharp_edges, tessellated

MARGIN = 0.1
"""Planes end this far beyond the box around the grains, relative to its diagonal."""


@dataclass(frozen=True)
class WallBody:
    """The walls of one effect, which form a rigid body.

    name : of the effect. planes : infinite walls. shapes : all others. material : name of their material;
    None for the first of the scene, or none.
    """

    name: str
    planes: tuple[Plane, ...] = ()
    shapes: tuple[Shape, ...] = ()
    motion: Motion = field(default_factory=Fixed)
    material: str | None = None


@singledispatch
def wall_body(effect: Effect) -> WallBody | None:
    """Return the walls of an effect that are drawn and exported; None if it has none. The container of a
    packing is no such body, as it may grow: see ``placed_container``.

    An effect with walls of its own registers a function here.
    """
    return None


@wall_body.register
def _(effect: Walls) -> WallBody:
    shapes = [shape for name, _ in effect.lists() for shape in getattr(effect, name)]
    shapes += [effect.surface] if effect.surface else []
    finite = tuple(one for one in shapes if not isinstance(one, Plane))
    return WallBody(effect.label, effect.planes, finite, effect.motion, effect.material)


@dataclass(frozen=True)
class PlacedWalls:
    """The surface of the walls of one effect, at a time.

    name : of the effect. triangles : m, shape (n, 3, 3). edges : the rims and the sharp edges, m, shape (k,
    2, 3). fixed : whether the walls are the same at all times. material : as of ``WallBody``.
    """

    name: str
    triangles: np.ndarray
    edges: np.ndarray
    fixed: bool
    material: str | None = None


def placed_walls(
    effects: Iterable[Effect],
    time: float,
    around: np.ndarray,
    measures: Mapping[str, float] | None = None,
    reach: float = np.inf,
) -> list[PlacedWalls]:
    """Return the walls among the effects of a scene, at a time (s).

    around : points (m, shape (n, 3)), such as of grains. Planes end slightly beyond the box around these
        points and all other walls, and at other planes of their body. measures : of the world at the time;
        without the travel of a body that forces move, the body is left out. reach : walls farther away than
        this, relative to the size of this box without them, are left out.
    """
    bodies = []
    for walls in filter(None, map(wall_body, effects)):
        travel = (measures or {}).get(f"{walls.name}_travel", 0.0 if time == 0 else np.nan)
        if not walls.motion.quantities or np.isfinite(travel):
            bodies.append((walls, travel, *_finite(walls)))
    ends = [placed(walls.motion, finite.reshape(-1, 3), time, travel) for walls, travel, finite, _ in bodies]
    points = np.concatenate([around, *ends])
    if not len(points):
        # Planes alone: any place will do.
        points = np.array([np.zeros(3), np.ones(3)])
    inner = around if len(around) else points
    middle = (inner.min(axis=0) + inner.max(axis=0)) / 2
    limit = reach * max(float(np.linalg.norm(np.ptp(inner, axis=0))), 1e-300)
    points = points[np.linalg.norm(points - middle, axis=1) <= limit]
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * float(np.linalg.norm(high - low))
    box = box_corners(low - margin, high + margin)
    found = []
    for walls, travel, finite, edges in bodies:
        # The planes are cut by the box in the frame of the body.
        inside = placed(walls.motion, box, -time, -travel)
        polygons = [fan(polygon) for polygon in bounded_planes(walls.planes, inside)]
        corners = np.concatenate([finite, *polygons])
        lines = np.concatenate([edges, *(sharp_edges(polygon) for polygon in polygons)])
        corners, lines = (
            placed(walls.motion, each.reshape(-1, 3), time, travel).reshape(each.shape)
            for each in (corners, lines)
        )
        near = [(np.linalg.norm(each - middle, axis=2) <= limit).all(axis=1) for each in (corners, lines)]
        # The ends of planes move with the grains.
        fixed = not walls.motion.moves and not walls.planes
        found.append(PlacedWalls(walls.name, corners[near[0]], lines[near[1]], fixed, walls.material))
    return found


def placed_container(scene: SceneParts, state: Mapping[str, np.ndarray]) -> PlacedWalls | None:
    """Return the walls of the container of a packing, which may grow with the bodies of a state; None if
    there is no container, or no body."""
    walls, (low, high) = confinement(scene), scene.domain.bounds()
    if walls is None or low is None or high is None or not len(state["radius"]):
        return None
    unit = hard_bodies(scene)[0].unit_of(state)
    triangles = low + walls.container.triangles(high - low, unit)
    return PlacedWalls(walls.label, triangles, sharp_edges(triangles), not any(walls.container.scaled()))


def placed_surfaces(
    scene: SceneParts,
    time: float,
    around: np.ndarray,
    measures: Mapping[str, float] | None = None,
    state: Mapping[str, np.ndarray] | None = None,
    reach: float = np.inf,
) -> list[PlacedWalls]:
    """Return the walls of a scene at a time (s), as ``placed_walls``, and the container of a packing.

    state : of the bodies at the time; without it the container is left out.
    """
    placed = placed_walls(scene.effects, time, around, measures, reach)
    if state is not None and (container := placed_container(scene, state)) is not None:
        placed.append(container)
    return placed


def names_of_surfaces(scene: SceneParts) -> list[str]:
    """Return the names of all effects that ``placed_surfaces`` may draw, in the order of the scene."""
    held = confinement(scene)
    return [one.label for one in scene.effects if wall_body(one) is not None or one is held]


@lru_cache(maxsize=16)
def _finite(walls: WallBody) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles and the edges of all walls of a body but planes, m."""
    each = [tessellated(shape) for shape in walls.shapes]
    triangles = np.concatenate([np.empty((0, 3, 3)), *each])
    return triangles, np.concatenate([np.empty((0, 2, 3)), *(sharp_edges(one) for one in each)])


@singledispatch
def placed(motion: Motion, points: np.ndarray, time: float, travel: float = 0.0) -> np.ndarray:
    """Return the positions of points of a body (m) at a time (s). With -time and -travel, points in space are
    transformed to the frame of the body.

    travel : distance (m) that a servo has moved.
    """
    raise NotImplementedError(f"where {motion.kind()} has a body is not known from the time")


@placed.register
def _(motion: Fixed, points: np.ndarray, time: float, travel: float = 0.0) -> np.ndarray:
    return points


@placed.register
def _(motion: Translation, points: np.ndarray, time: float, travel: float = 0.0) -> np.ndarray:
    moving = np.copysign(max(abs(time) - motion.begin, 0.0), time)
    return points + moving * np.array(motion.velocity)


@placed.register
def _(motion: Oscillation, points: np.ndarray, time: float, travel: float = 0.0) -> np.ndarray:
    way = np.sin(2 * np.pi * motion.frequency * abs(time) + motion.phase) * np.array(motion.amplitude)
    return points + np.copysign(1.0, time) * way


@placed.register
def _(motion: Rotation, points: np.ndarray, time: float, travel: float = 0.0) -> np.ndarray:
    turned: np.ndarray = Turn.from_rotvec(time * np.array(motion.rate)).apply(points - motion.centre)
    return turned + motion.centre


@placed.register
def _(motion: Servo, points: np.ndarray, time: float, travel: float = 0.0) -> np.ndarray:
    return points + travel * np.array(motion.unit_vector())
