"""Grains and packed bodies as the solids of a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from scipy.spatial.transform import Rotation

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.effects.base import Shaped
from tisim.plotting.image import draw_solids, extent_of, window_of
from tisim.plotting.scenery import NO_SCENERY, Scenery
from tisim.rendering.camera import USUAL_CAMERA, Camera
from tisim.rendering.solids import DrawnRods, DrawnSpheres, Solids
from tisim.rendering.superquadrics import DrawnSuperquadrics
from tisim.scene.scene import Scene
from tisim.shapes.particle_shape import ParticleShape


def shapes_of(scene: Scene) -> tuple[ParticleShape, ...]:
    """Return the shapes of the particles of a scene; empty if they are spheres."""
    return next((tuple(one.shapes()) for one in scene.effects if isinstance(one, Shaped)), ())


def solids_of(
    state: Mapping[str, np.ndarray], shapes: Sequence[ParticleShape], colours: np.ndarray
) -> list[Solids]:
    """Return the particles of a state as solids.

    state : ``position`` and ``radius``; with shapes also ``orientation`` and ``shape``, and the radius is of
    the bounding sphere. shapes : empty for spheres. colours : red, green and blue (0..1), shape (n, 3).
    """
    centre, radius = state["position"], state["radius"]
    if not shapes:
        return [DrawnSpheres(centre=centre, colour=colours, radius=radius)]
    found: list[Solids] = []
    for k, shape in enumerate(shapes):
        own = np.flatnonzero(state["shape"] == k)
        turn = np.asarray(state["orientation"])[own]
        # Bodies whose orientation is not finite are left out with those whose position is not.
        sound = np.isfinite(turn).all(axis=1) & (np.linalg.norm(turn, axis=1) > 0)
        own, turn = own[sound], turn[sound]
        if not len(own):
            continue
        size = radius[own] / shape.bounding_radius()
        turns = Rotation.from_quat(turn, scalar_first=True).as_matrix()
        rod, superquadric = shape.rod(), shape.superquadric()
        if rod is not None:
            half, thick = rod
            found.append(
                DrawnRods(
                    centre=centre[own], colour=colours[own], axis=turns[:, :, 2], half=half * size,
                    radius=thick * size,
                )
            )  # fmt: skip
        elif superquadric is not None:
            semi_axes, exponents = (np.array(one) for one in superquadric)
            found.append(
                DrawnSuperquadrics(
                    centre=centre[own], colour=colours[own], turn=turns, semi_axes=size[:, None] * semi_axes,
                    exponents=np.tile(exponents, (len(own), 1)),
                )
            )  # fmt: skip
        else:
            raise NotImplementedError(f"{shape.kind()} is neither a rod nor a superquadric")
    return found


def draw_bodies(
    axis: Axes,
    packing: PackedBodies,
    colours: np.ndarray,
    camera: Camera = USUAL_CAMERA,
    around: Scenery = NO_SCENERY,
) -> None:
    """Draw the bodies of a packing without perspective, and all of their surroundings.

    colours : red, green and blue (0..1) of each body, shape (n, 3).
    """
    bounding = np.array([one.bounding_radius() for one in packing.shapes])
    state = {
        "position": packing.position,
        "radius": packing.scale * bounding[packing.shape],
        "orientation": packing.orientation,
        "shape": packing.shape,
    }
    solids = solids_of(state, packing.shapes, colours)
    corners = [camera.project(around.points)[:, :2], *(extent_of(solids, camera) or ())]
    every = np.concatenate([one.reshape(-1, 2) for one in corners])
    part = window_of(every.min(axis=0), every.max(axis=0)) if len(every) else None
    draw_solids(axis, solids, part, around.walls, around.edges, camera)
