"""A picture of clusters: particles coloured by cluster, and outlines of the region that they occupy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from tisim.analysis.bounding_ellipsoid import Ellipsoid
from tisim.plotting.cloud import directions, panel
from tisim.plotting.scenery import box_scenery, window
from tisim.plotting.style import empty, legend_above
from tisim.rendering.camera import USUAL_CAMERA
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

CLUSTER_COLOURS = colormaps["tab20"](np.arange(20))[:, :3]
"""Colours of clusters, such that clusters adjacent in size have different colours."""
SINGLE = (0.88, 0.88, 0.88)
"""Grey of particles without bonds."""
AROUND = np.linspace(0, 2 * np.pi, 73)
"""Angles of the points of a circle, rad."""


def clusters(
    state: Arrays, cluster: np.ndarray, scene: Scene, ellipsoid: Ellipsoid | None = None, hull: bool = False
) -> Figure:
    """Draw the particles of a state in a projection without perspective: single particles in grey, others in
    the colour of their cluster.

    cluster : cluster number of each particle, as returned by ``tisim.analysis.labels``.
    ellipsoid : an ellipsoid around all particles, drawn as its outline.
    hull : whether to draw the outline of the convex hull of the spheres.
    """
    figure = empty(5.6, 5.4)
    axis = figure.subplots()
    colours = cluster_colours(cluster)
    lines = [] if ellipsoid is None else [_silhouette(ellipsoid)]
    box = box_scenery(*scene.domain.bounds())
    # Points in space with the same projection as the outline of the ellipsoid.
    ends = [line @ USUAL_CAMERA.axes[:, :2].T for line in lines]
    part = window([state], [replace(box, points=np.vstack([box.points, *ends]))])
    panel(axis, state, part, box, colours)
    for line in lines:
        axis.plot(*line.T, color="0.2", lw=1.2, zorder=3, label="bounding ellipsoid")
    if hull:
        axis.plot(*_outline(state).T, color="0.2", lw=1.2, ls="--", zorder=3, label="convex hull")
    if lines or hull:
        legend_above(axis)
    directions(axis, part, np.zeros(3))
    size = np.bincount(cluster)
    several = int((size > 1).sum())
    bound = int(size[size > 1].sum())
    axis.set_title(f"{bound} of {len(cluster)} in {several} clusters", loc="left", fontsize=10)
    return figure


def cluster_colours(cluster: np.ndarray) -> np.ndarray:
    """Return the colour of each particle by its cluster number, grey for single particles; shape (n, 3)."""
    size = np.bincount(cluster)
    rank = np.empty(len(size), int)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
    colours = CLUSTER_COLOURS[rank[cluster] % len(CLUSTER_COLOURS)]
    colours[size[cluster] == 1] = SINGLE
    return np.asarray(colours)


def _silhouette(ellipsoid: Ellipsoid) -> np.ndarray:
    """Return the projected outline of an ellipsoid, m, shape (n, 2): the image of a circle under the square
    root of M M^T, with M of the projected semi-axes."""
    seen = USUAL_CAMERA.axes[:, :2].T @ (ellipsoid.axes.T * ellipsoid.semi_axes)
    squares, axes = np.linalg.eigh(seen @ seen.T)
    circle = np.column_stack([np.cos(AROUND), np.sin(AROUND)])
    return USUAL_CAMERA.project(ellipsoid.centre)[:2] + circle * np.sqrt(squares) @ axes.T


def _outline(state: Arrays) -> np.ndarray:
    """Return the projected outline of the convex hull of spheres, m, shape (n, 2)."""
    circle = np.column_stack([np.cos(AROUND), np.sin(AROUND)])
    rims = USUAL_CAMERA.project(state["position"])[:, None, :2] + state["radius"][:, None, None] * circle
    points = rims.reshape(-1, 2)
    ring = ConvexHull(points).vertices
    return points[np.append(ring, ring[0])]
