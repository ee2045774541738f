"""Rendered pictures within the axes of figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from tisim.rendering.camera import USUAL_CAMERA, Camera, ClipPlane, Raster, Window
from tisim.rendering.render import render
from tisim.rendering.solids import Solids
from tisim.rendering.surfaces import DrawnLines, DrawnTriangles

PIXELS = 800
"""Number of pixels of the longer side of a picture."""
BORDER = 0.03
"""Space around solids on each side, relative to the longer side."""


def draw_solids(
    axis: Axes,
    solids: Sequence[Solids],
    window: Window | None = None,
    walls: Sequence[DrawnTriangles] = (),
    edges: Sequence[DrawnLines] = (),
    camera: Camera = USUAL_CAMERA,
    clip: Sequence[ClipPlane] = (),
    pixels: int = PIXELS,
) -> None:
    """Draw solids, walls and edges in axes whose coordinates are right and up in m. Axes are hidden.

    window : by default the rectangle around all solids. pixels : of its longer side.
    """
    if window is None:
        window = around(solids, camera)
    side = max(window.width, window.height)
    columns, rows = (max(1, round(pixels * length / side)) for length in (window.width, window.height))
    picture = render(Raster(camera, window, columns, rows), solids, walls, edges, clip)
    left, bottom = window.left, window.bottom
    extent = (left, left + window.width, bottom, bottom + window.height)
    axis.imshow(np.clip(picture.rgba, 0, 1), extent=extent, origin="lower", zorder=2)
    axis.set_xlim(extent[0], extent[1])
    axis.set_ylim(extent[2], extent[3])
    axis.set_axis_off()


def around(solids: Sequence[Solids], camera: Camera = USUAL_CAMERA) -> Window:
    """Return the rectangle around solids with a border; of side 1 m if there are none."""
    found = extent_of(solids, camera)
    return Window(-0.5, -0.5, 1.0, 1.0) if found is None else window_of(*found)


def extent_of(
    solids: Sequence[Solids], camera: Camera = USUAL_CAMERA
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the least and largest coordinates right and up (m, shape (2,)) of solids; None if there are
    none."""
    some = [one for one in (one.finite() for one in solids) if len(one)]
    if not some:
        return None
    low = np.concatenate([camera.project(one.centre)[:, :2] - one.sizes()[:, None] for one in some])
    high = np.concatenate([camera.project(one.centre)[:, :2] + one.sizes()[:, None] for one in some])
    rough = window_of(low.min(axis=0), high.max(axis=0))
    # The spheres around rods are much larger than the rods.
    raster = Raster(camera, rough, PIXELS, PIXELS)
    splats = [one.seen_on(raster).splats() for one in some]
    corner = np.array([rough.left, rough.bottom])
    least = np.concatenate([one.low[:, :2] for one in splats]).min(axis=0)
    greatest = np.concatenate([one.high[:, :2] for one in splats]).max(axis=0)
    return corner + least / raster.scale, corner + greatest / raster.scale


def window_of(low: np.ndarray, high: np.ndarray, ratio: float | None = None) -> Window:
    """Return a window with a border around a rectangle (corners right and up, m, shape (2,)).

    ratio : width over height, to which the window is enlarged; by default as the rectangle.
    """
    middle, size = (low + high) / 2, high - low
    size = size + 2 * BORDER * size.max()
    if ratio is not None:
        size = np.array([max(size[0], ratio * size[1]), max(size[1], size[0] / ratio)])
    left, bottom = middle - size / 2
    return Window(float(left), float(bottom), float(size[0]), float(size[1]))
