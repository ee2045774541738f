"""Pictures of solids between walls, by ray casting: one ray through each point of the picture.

Solids are opaque. Walls in front of solids are transparent, and the farthest wall behind them is opaque, so
that a hopper shows its content. Edges are hidden by solids only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from tisim.rendering.camera import ClipPlane, Raster
from tisim.rendering.shading import AMBIENT, WALL_AMBIENT, lit, occlusion
from tisim.rendering.solids import Solids
from tisim.rendering.surfaces import DrawnLines, DrawnTriangles
from tisim.rendering.z_buffer import Planes, entry, layer

FINER = 2
"""Rays along each side of a pixel; more give smoother edges."""
GLASS = 0.13
"""Opacity of walls in front of solids."""
BEHIND_GLASS = 0.6
"""Opacity of edges in front of solids."""
LIFT = 1.5
"""Edges are drawn if they are at most this far behind a solid, pixels, since they lie in surfaces."""
SHADED_AT_ONCE = 1_000_000
"""Number of rays that are shaded at a time."""


@dataclass(frozen=True)
class Picture:
    """A picture.

    rgba : red, green, blue and opacity, 0..1, shape (rows, columns, 4), from the lowest row upwards. depth :
    distance of the nearest surface towards the viewer, pixels, -inf if there is none, shape (rows,
    columns).
    """

    rgba: np.ndarray
    depth: np.ndarray


@dataclass(frozen=True)
class _Seen:
    """Colours and depths along all rays; the depth is -inf for a ray that meets nothing."""

    rgb: np.ndarray
    depth: np.ndarray


def render(
    raster: Raster,
    solids: Sequence[Solids],
    walls: Sequence[DrawnTriangles] = (),
    edges: Sequence[DrawnLines] = (),
    clip: Sequence[ClipPlane] = (),
) -> Picture:
    """Return the picture of solids, walls and edges (all in m). Those that are not finite are left out.

    clip : planes that cut solids and walls.
    """
    fine = raster.finer(FINER)
    planes = [plane.on(fine) for plane in clip]
    bodies = _seen(fine, solids, planes)
    rgb, depth, alpha = bodies.rgb, bodies.depth, np.isfinite(bodies.depth).astype(np.float32)
    if any(len(one) for one in walls):
        back, front = (_seen(fine, walls, planes, farthest) for farthest in (True, False))
        behind = np.isneginf(depth) & np.isfinite(back.depth)
        rgb[behind], depth = back.rgb[behind], np.where(behind, back.depth, depth)
        alpha[behind] = 1
        ahead = front.depth > depth + LIFT
        rgb[ahead] += GLASS * (front.rgb[ahead] - rgb[ahead])
    shade = _shade(bodies.depth, solids, fine)
    if depth is not bodies.depth:
        # Walls in front of solids cast no shade on them.
        on_walls = _shade(depth, solids, fine)
        shade = np.where(np.isneginf(bodies.depth), on_walls, shade)
    rgb *= shade[..., None]
    if any(len(one) for one in edges):
        lines = _seen(fine, edges, planes)
        hidden = lines.depth < bodies.depth - LIFT * FINER
        ahead = np.isfinite(lines.depth) & ~hidden
        opacity = np.where(np.isfinite(bodies.depth[ahead]), BEHIND_GLASS, 1)[:, None]
        rgb[ahead] += opacity * (lines.rgb[ahead] - rgb[ahead])
        alpha[ahead] = 1
        depth = np.where(ahead, np.maximum(depth, lines.depth), depth)
    return _resolved(rgb, alpha, depth, raster)


def _seen(fine: Raster, groups: Sequence[Solids], planes: Planes, farthest: bool = False) -> _Seen:
    """Return colours and depths of the nearest solids, or the farthest, without the shade of narrow
    places."""
    placed = [group.finite().seen_on(fine).finite() for group in groups]
    found = layer(placed, fine.columns, fine.rows, planes, farthest)
    rgb = np.zeros((fine.rows * fine.columns, 3), np.float32)
    depth = np.full(fine.rows * fine.columns, -np.inf, np.float32)
    for group, pixels, solid in found.visible():
        for begin in range(0, len(pixels), SHADED_AT_ONCE):
            at, k = pixels[begin : begin + SHADED_AT_ONCE], solid[begin : begin + SHADED_AT_ONCE]
            x, y = at % fine.columns + 0.5, at // fine.columns + 0.5
            z, cut = entry(group, k, x, y, planes)
            normal = group.normal(k, np.stack([x, y, z], axis=1)).copy()
            # Cuts are equally bright, whichever way they face.
            normal[cut >= 0] = (0.0, 0.0, 1.0)
            depth[at] = z
            if isinstance(group, DrawnLines):
                rgb[at] = group.colour[k]
            else:
                ambient = WALL_AMBIENT if isinstance(group, DrawnTriangles) else AMBIENT
                rgb[at] = lit(normal, group.colour[k], ambient)
    shape = fine.rows, fine.columns
    return _Seen(rgb.reshape(*shape, 3), depth.reshape(shape))


def _shade(depth: np.ndarray, solids: Sequence[Solids], fine: Raster) -> np.ndarray:
    """Return the shade of narrow places, from the depths of the pixels of the picture."""
    coarse = _blocks(depth, np.maximum) / FINER
    sizes = [group.sizes() * fine.scale / FINER for group in solids if len(group)]
    radius = float(np.median(np.concatenate(sizes))) if sizes else 1.0
    shade = occlusion(coarse, radius if np.isfinite(radius) else 1.0)
    return np.repeat(np.repeat(shade, FINER, axis=0), FINER, axis=1)


def _resolved(rgb: np.ndarray, alpha: np.ndarray, depth: np.ndarray, raster: Raster) -> Picture:
    """Return the picture with the mean of the rays of each pixel."""
    covered = _blocks(alpha, np.add)
    rgba = np.empty((raster.rows, raster.columns, 4), np.float32)
    rgba[..., :3] = _blocks(rgb * alpha[..., None], np.add) / np.maximum(covered, 1e-9)[..., None]
    rgba[..., 3] = covered / FINER**2
    return Picture(rgba, _blocks(depth, np.maximum) / FINER)


def _blocks(values: np.ndarray, combine: np.ufunc) -> np.ndarray:
    """Return the combination of the rays of each pixel."""
    # NumPy reduces along short axes slowly.
    rows = reduce(combine, [values[k::FINER] for k in range(FINER)])
    return np.asarray(reduce(combine, [rows[:, k::FINER] for k in range(FINER)]))
