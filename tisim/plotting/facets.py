"""Bodies of any shape as shaded polygons, in the projection of all pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from scipy.spatial.transform import Rotation

from tisim.effects.base import Shaped
from tisim.scene.scene import Scene
from tisim.shapes.particle_shape import ParticleShape

AZIMUTH, ELEVATION = np.radians(-62.0), np.radians(18.0)
"""Direction of the viewer: azimuth from x in the xy plane, and elevation, rad."""
_TOWARDS = np.array([
    np.cos(ELEVATION) * np.cos(AZIMUTH), np.cos(ELEVATION) * np.sin(AZIMUTH), np.sin(ELEVATION)
])  # fmt: skip
_RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
PROJECTION = np.stack([_RIGHT, np.cross(_TOWARDS, _RIGHT), _TOWARDS], axis=1)
"""Matrix that projects a point to coordinates right, up and towards the viewer."""
LIGHT = np.array([-0.45, 0.6, 0.66])
"""Direction of the light in coordinates right, up and towards the viewer."""
SHADE = 0.45
"""Brightness of a facet that faces away from the light."""
FACET_RINGS, FACET_SECTORS = 10, 16
"""Numbers of facets of a body between its poles, and around its axis."""
MANY = 1000
"""Number of bodies from which each has a quarter of the facets, so that a picture takes seconds."""


def facets(
    shape: ParticleShape, rings: int = FACET_RINGS, sectors: int = FACET_SECTORS
) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (m) and the unit normals of the facets of a shape, shape (f, 4, 3) and (f, 3).

    Corners are the farthest points along directions on rings about z, so there are few on flat faces and
    cylinders, and many on edges.
    """
    polar = np.linspace(0, np.pi, rings + 1)
    azimuth = 2 * np.pi * (np.arange(sectors + 1) + 0.5) / sectors
    theta, phi = np.meshgrid(polar, azimuth, indexing="ij")
    normal = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    point = shape.support(normal)
    corners = point[:-1, :-1], point[:-1, 1:], point[1:, 1:], point[1:, :-1]
    quads = np.stack(corners, axis=2).reshape(-1, 4, 3)
    across = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    size = np.linalg.norm(across, axis=1)
    kept = size > 1e-12 * size.max()
    outward = across[kept] / size[kept, None]
    outward *= np.sign(np.einsum("fk,fk->f", outward, quads[kept].mean(axis=1)))[:, None]
    return quads[kept], outward


def shapes_of(scene: Scene) -> tuple[ParticleShape, ...]:
    """Return the shapes of the particles of a scene; empty if they are spheres."""
    return next((tuple(one.shapes()) for one in scene.effects if isinstance(one, Shaped)), ())


def draw_shapes(
    axis: Axes,
    state: Mapping[str, np.ndarray],
    shapes: Sequence[ParticleShape],
    colours: np.ndarray,
) -> None:
    """Draw particles of shapes without perspective, nearest last, with shading.

    state : ``position``, ``radius`` (of the bounding sphere), ``orientation`` and ``shape`` of the particles.
    colours : red, green and blue (0..1) of each, shape (n, 3).
    """
    if not len(state["radius"]):
        return
    corners, tints, depths = [], [], []
    turns = Rotation.from_quat(state["orientation"], scalar_first=True)
    detail = 1 if len(state["radius"]) < MANY else 2
    for k, shape in enumerate(shapes):
        quads, outward = facets(shape, FACET_RINGS // detail, FACET_SECTORS // detail)
        for i in np.flatnonzero(state["shape"] == k):
            scale = state["radius"][i] / shape.bounding_radius()
            normal = turns[i].apply(outward) @ PROJECTION
            front = normal[:, 2] > 0
            place = state["position"][i] + scale * turns[i].apply(quads[front].reshape(-1, 3))
            seen = (place @ PROJECTION).reshape(-1, 4, 3)
            bright = SHADE + (1 - SHADE) * np.clip(normal[front] @ LIGHT, 0, 1)
            corners.append(seen[:, :, :2])
            tints.append(bright[:, None] * colours[i])
            depths.append(seen[:, :, 2].mean(axis=1))
    order = np.argsort(np.concatenate(depths))
    tint = np.concatenate(tints)[order]
    polygons = np.concatenate(corners)[order]
    # Edges in the colour of the facet close the gaps between facets.
    axis.add_collection(
        PolyCollection(list(polygons), facecolors=tint, edgecolors=tint, linewidths=0.5, zorder=2)
    )
