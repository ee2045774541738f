"""A picture of a packing: bodies of any shape, each with its own colour."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.plotting.facets import draw_shapes


def draw_bodies(axis: Axes, packing: PackedBodies, colours: np.ndarray) -> None:
    """Draw the bodies of a packing without perspective, nearest last, with shading.

    colours : red, green and blue (0..1) of each body, shape (n, 3).
    """
    bounding = np.array([one.bounding_radius() for one in packing.shapes])
    radius = packing.scale * bounding[packing.shape]
    state = {"position": packing.position, "radius": radius, "orientation": packing.orientation}
    draw_shapes(axis, {**state, "shape": packing.shape}, packing.shapes, colours)
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_axis_off()
