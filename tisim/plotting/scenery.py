"""The surroundings of grains in pictures: walls, the box, magnets and fibres; and the window around all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tisim.effects.walls.placement import placed_surfaces
from tisim.geometry.tessellation import BOX_EDGES, box_corners
from tisim.plotting.image import extent_of, window_of
from tisim.plotting.look import USUAL, Look
from tisim.rendering.camera import Window
from tisim.rendering.solids import DrawnCylinders, DrawnSpheres, Solids
from tisim.rendering.surfaces import DrawnLines, DrawnTriangles
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.magnets import Magnets
from tisim.sources.magnetic.sphere import Sphere
from tisim.sources.pore_flow.pore_flow import PoreFlow

WALL_COLOUR = (0.86, 0.85, 0.82)
"""Colour of walls: red, green and blue, 0..1."""
EDGE_COLOUR, EDGE_WIDTH = (0.45, 0.45, 0.45), 2.2
"""Colour of edges of walls, and their width, rays."""
BOX_COLOUR, BOX_WIDTH = (0.55, 0.55, 0.55), 1.8
"""Colour and width of the edges of the box, as of walls."""
BODY_COLOUR = (0.70, 0.72, 0.75)
"""Colour of magnets and fibres."""
FAR = 20.0
"""Walls farther away than this, relative to the size of the scene, are left out."""
OUTER_PART = 10.0
"""Percentage of grains at each end of a coordinate by which the extent of the others is measured."""
FENCE = 2.0
"""Grains farther than this many extents from the others have left the scene, and do not widen the picture."""
BESIDE = 1.0
"""With walls or a box, grains that come later widen a picture by at most this on each side, relative to its
size without them."""


@dataclass(frozen=True)
class Scenery:
    """The surroundings of grains.

    points : corners of walls and of the box, m, shape (n, 3). bounded : whether there are any.
    """

    solids: tuple[Solids, ...] = ()
    walls: tuple[DrawnTriangles, ...] = ()
    edges: tuple[DrawnLines, ...] = ()
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    bounded: bool = False


NO_SCENERY = Scenery()
"""The surroundings of grains in open space."""


def box_scenery(low: np.ndarray | None, high: np.ndarray | None) -> Scenery:
    """Return the edges of a box (m); nothing in open space."""
    if low is None or high is None:
        return NO_SCENERY
    corners = box_corners(np.asarray(low, float), np.asarray(high, float))
    edges = DrawnLines.of(
        np.array([corners[list(ends)] for ends in BOX_EDGES]), np.array(BOX_COLOUR), BOX_WIDTH
    )
    return Scenery(edges=(edges,), points=corners, bounded=True)


def wall_scenery(triangles: np.ndarray, edges: np.ndarray) -> Scenery:
    """Return walls as glass. triangles : m, shape (n, 3, 3). edges : m, shape (k, 2, 3)."""
    walls = (DrawnTriangles.of(triangles, np.array(WALL_COLOUR)),) if len(triangles) else ()
    lines = (DrawnLines.of(edges, np.array(EDGE_COLOUR), EDGE_WIDTH),) if len(edges) else ()
    return Scenery(walls=walls, edges=lines, points=triangles.reshape(-1, 3), bounded=bool(len(triangles)))


def scenery(
    scene: Scene,
    states: Sequence[Arrays],
    time: float,
    measures: Mapping[str, float] | None = None,
    now: Arrays | None = None,
) -> Scenery:
    """Return the surroundings of the grains of a scene at a time (s).

    states : the planes of walls end around their grains. measures : of the world at the time, which have the
    positions of bodies that forces move; such a body is left out if they are not known. now : the state at
    the time, as the container of a packing may grow with its bodies; it is left out if it is not known.
    """
    box, bodies = box_scenery(*scene.domain.bounds()), _bodies(scene)
    around = np.concatenate([box.points, *_extents(bodies), *_extents_of_grains(states)])
    placed = placed_surfaces(scene, time, around, measures, now, FAR)
    each = [box, *(wall_scenery(one.triangles, one.edges) for one in placed)]
    walls = tuple(part for one in each for part in one.walls)
    edges = tuple(part for one in each for part in one.edges)
    points = np.concatenate([one.points for one in each])
    return Scenery(tuple(bodies), walls, edges, points, bool(len(points)))


def _bodies(scene: Scene) -> list[Solids]:
    """Return the magnets of a scene, and the fibres and spheres of its flow, each once."""
    bodies: list[Cylinder | Sphere] = []
    for effect in scene.effects:
        if isinstance(effect, Magnets):
            bodies += effect.bodies()
        elif isinstance(effect, PoreFlow):
            bodies += [*effect.cylinders, *effect.spheres]
    # A filter has the same fibres as magnets and as solids in the flow.
    different = {(one.centre, one.radius, getattr(one, "axis", None)): one for one in bodies}.values()
    cylinders = [one for one in different if isinstance(one, Cylinder)]
    spheres = [one for one in different if isinstance(one, Sphere)]
    found: list[Solids] = []
    if cylinders:
        found.append(
            DrawnCylinders(
                centre=np.array([one.centre for one in cylinders]),
                colour=np.tile(BODY_COLOUR, (len(cylinders), 1)),
                axis=np.array([one.direction for one in cylinders]),
                half=np.array([one.length / 2 for one in cylinders]),
                radius=np.array([one.radius for one in cylinders]),
            )
        )  # fmt: skip
    if spheres:
        found.append(
            DrawnSpheres(
                centre=np.array([one.centre for one in spheres]),
                colour=np.tile(BODY_COLOUR, (len(spheres), 1)),
                radius=np.array([one.radius for one in spheres]),
            )
        )  # fmt: skip
    return found


def _extents(bodies: Sequence[Solids]) -> list[np.ndarray]:
    """Return the lower and upper corners (m) of boxes around bodies."""
    points = []
    for one in bodies:
        spread = np.tile(one.sizes()[:, None], (1, 3))
        if isinstance(one, DrawnCylinders):
            across = np.sqrt(np.clip(1 - one.axis**2, 0, 1))
            spread = one.half[:, None] * np.abs(one.axis) + one.radius[:, None] * across
        points += [one.centre - spread, one.centre + spread]
    return points


def _extents_of_grains(states: Sequence[Arrays]) -> list[np.ndarray]:
    """Return corners of boxes (m) around the grains: of the first state all, of later ones all that have not
    left."""
    points = []
    for number, state in enumerate(states):
        place, radius = finite_grains(state)
        if number:
            kept = remaining(place, radius)
            place, radius = place[kept], radius[kept]
        if len(place):
            spread = radius[:, None]
            points += [(place - spread).min(axis=0)[None], (place + spread).max(axis=0)[None]]
    return points


def finite_grains(state: Arrays) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions and radii (m) of the grains whose position is finite."""
    place, radius = np.asarray(state["position"], float), np.asarray(state["radius"], float)
    sound = np.isfinite(place).all(axis=1) & np.isfinite(radius)
    return place[sound], radius[sound]


def remaining(place: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return whether grains have not left the others, shape (n,).

    Along each coordinate a grain remains within two extents of the others, measured without the outer tenths.
    place : m, shape (n, 2 or 3).
    """
    if not len(place):
        return np.zeros(0, bool)
    low, high = np.percentile(place, [OUTER_PART, 100 - OUTER_PART], axis=0)
    reach = FENCE * (float((high - low).max()) + 2 * float(np.percentile(radius, 100 - OUTER_PART)))
    kept: np.ndarray = ((place >= low - reach) & (place <= high + reach)).all(axis=1)
    return kept


def window(
    states: Sequence[Arrays],
    surroundings: Sequence[Scenery] = (),
    look: Look = USUAL,
    ratio: float = 1.0,
) -> Window:
    """Return the window that shows states and their surroundings, or the part of it that ``look`` shows.

    All grains of the first state are in it, and of later ones all that have not left. ratio : width over
    height.
    """
    camera = look.camera
    fixed = [_rectangle(camera.project(one.points)[:, :2]) for one in surroundings if len(one.points)]
    fixed += [found for one in surroundings if (found := extent_of(one.solids, camera)) is not None]
    later: list[tuple[np.ndarray, np.ndarray]] = []
    for number, state in enumerate(states):
        place, radius = finite_grains(state)
        right_up = camera.project(place)[:, :2]
        kept = remaining(right_up, radius) if number else np.ones(len(place), bool)
        if kept.any():
            right_up, size = right_up[kept], radius[kept, None]
            grains = _rectangle(np.concatenate([right_up - size, right_up + size]))
            (later if number else fixed).append(grains)
    if fixed and any(one.bounded for one in surroundings):
        low, high = _rectangle(np.concatenate(fixed))
        beside = BESIDE * (high - low).max()
        later = [(np.clip(a, low - beside, high), np.clip(b, low, high + beside)) for a, b in later]
    if not fixed + later:
        return Window(-0.5, -0.5, 1.0, 1.0)
    whole = window_of(*_rectangle(np.concatenate(fixed + later)), ratio)
    left, right, bottom, top = look.crop
    return Window(
        whole.left + left * whole.width, whole.bottom + bottom * whole.height,
        (right - left) * whole.width, (top - bottom) * whole.height,
    )  # fmt: skip


def _rectangle(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the rectangle around points, shape (n, 2)."""
    return points.min(axis=0), points.max(axis=0)
