"""A picture of a packing: bodies of any shape, each with its own colour."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.plotting.cloud import PROJECTION
from tisim.shapes.particle_shape import ParticleShape

FACET_RINGS, FACET_SECTORS = 10, 16
"""Numbers of facets of a body between its poles, and around its axis."""
BODY_LIGHT = np.array([-0.45, 0.6, 0.66])
"""Direction of the light in coordinates right, up and towards the viewer."""
SHADE = 0.45
"""Brightness of a facet that faces away from the light."""


def facets(shape: ParticleShape) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (m) and the unit normals of the facets of a shape, shape (f, 4, 3) and (f, 3).

    Corners are the farthest points along directions on rings about z, so there are few on flat faces and
    cylinders, and many on edges.
    """
    polar = np.linspace(0, np.pi, FACET_RINGS + 1)
    azimuth = 2 * np.pi * (np.arange(FACET_SECTORS + 1) + 0.5) / FACET_SECTORS
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


def draw_bodies(axis: Axes, packing: PackedBodies, colours: np.ndarray) -> None:
    """Draw the bodies of a packing without perspective, nearest last, with shading.

    colours : red, green and blue (0..1) of each body, shape (n, 3).
    """
    corners, tints, depths = [], [], []
    turns = packing.turns
    for k, shape in enumerate(packing.shapes):
        quads, outward = facets(shape)
        for i in np.flatnonzero(packing.shape == k):
            turn = turns[i]
            normal = turn.apply(outward) @ PROJECTION
            front = normal[:, 2] > 0
            place = packing.position[i] + packing.scale[i] * turn.apply(quads[front].reshape(-1, 3))
            seen = (place @ PROJECTION).reshape(-1, 4, 3)
            bright = SHADE + (1 - SHADE) * np.clip(normal[front] @ BODY_LIGHT, 0, 1)
            corners.append(seen[:, :, :2])
            tints.append(bright[:, None] * colours[i])
            depths.append(seen[:, :, 2].mean(axis=1))
    order = np.argsort(np.concatenate(depths))
    tint = np.concatenate(tints)[order]
    polygons = np.concatenate(corners)[order]
    # Edges in the colour of the facet close the gaps between facets.
    axis.add_collection(PolyCollection(list(polygons), facecolors=tint, edgecolors=tint, linewidths=0.5))
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_axis_off()
