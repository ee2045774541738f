"""Light and shade: the brightness of surfaces, and the shade of narrow places."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

LIGHT = np.array([-0.45, 0.6, 0.66]) / np.linalg.norm([-0.45, 0.6, 0.66])
"""Direction of the light in coordinates right, up and towards the viewer."""
HALFWAY = (LIGHT + np.eye(3)[2]) / np.linalg.norm(LIGHT + np.eye(3)[2])
"""Normal of a surface that reflects the light towards the viewer."""
AMBIENT, WALL_AMBIENT = 0.45, 0.74
"""Brightness of solids, and of walls, that face away from the light."""
GLOSS, SHARPNESS = 0.22, 40
"""Brightness and exponent of the highlight."""
DARKEST = 0.08
"""Dark colours are lightened by this, so that their shading is visible."""
SHADE_DIRECTIONS = 8
"""Pairs of opposite directions in which the surroundings of a pixel are compared with it."""
SHADE = 1.1
"""Strength of the shade of narrow places."""
SMOOTHING = 0.35
"""Width over which the shade is smoothed, in units of the smaller distance."""
DARKEST_SHADE = 0.3
"""Brightness of the narrowest places."""
SHADE_DISTANCES, WIDE_SHADE = (1.5, 24.0), 3.0
"""Limits of the smaller distance of compared pixels, and the larger distance in units of the smaller one."""


def lit(normal: np.ndarray, colour: np.ndarray, ambient: float = AMBIENT) -> np.ndarray:
    """Return the colours of surfaces in the light.

    normal : unit normals, shape (n, 3). colour : red, green and blue, 0..1, shape (n, 3). ambient :
        brightness of surfaces that face away from the light.
    """
    towards = np.clip(normal @ LIGHT, 0, 1)
    gloss = GLOSS * np.clip(normal @ HALFWAY, 0, 1) ** SHARPNESS
    bright = ambient + (1 - ambient) * towards
    shaded: np.ndarray = bright[:, None] * (DARKEST + (1 - DARKEST) * colour) + gloss[:, None]
    return np.clip(shaded, 0, 1)


def occlusion(depth: np.ndarray, radius: float) -> np.ndarray:
    """Return the brightness of each pixel in light from all directions, 0..1, by the depths around it.

    A pixel is dark if the surface around it is nearer to the viewer. Depths in opposite directions are
    averaged, so that an inclined plane is bright.

        c = mean over pairs of max(0, ((z(r + d) + z(r - d))/2 - z(r))/|d|),    1 - c_near - c_wide

    A difference h of depth that exceeds |d| counts as |d|^2/h, so that distant surfaces cast no shade.

    depth : pixels, -inf for an empty pixel, shape (rows, columns). radius : usual radius of a solid,
        pixels.
    """
    bright = np.ones(depth.shape, np.float32)
    z = depth.astype(np.float32)
    near = float(np.clip(radius / 2, *SHADE_DISTANCES))
    for reach in (near, WIDE_SHADE * near):
        for angle in np.pi * (np.arange(SHADE_DIRECTIONS) + 0.5 * (reach > near)) / SHADE_DIRECTIONS:
            way = np.rint(reach * np.array([np.sin(angle), np.cos(angle)])).astype(int)
            length = np.float32(max(1.0, np.hypot(*way)))
            pair = (_nearer(z, way, length) + _nearer(z, -way, length)) / (2 * length)
            bright -= SHADE / (2 * SHADE_DIRECTIONS) * np.maximum(pair, 0)
    return np.maximum(gaussian_filter(bright, SMOOTHING * near, mode="nearest", truncate=2), DARKEST_SHADE)


def _nearer(z: np.ndarray, way: np.ndarray, most: np.float32) -> np.ndarray:
    """Return by how much the pixels at a distance are nearer than each, -most to most; -most beyond the edges
    of the picture."""
    result = np.full(z.shape, -most, np.float32)
    rows, columns = z.shape
    if abs(way[0]) >= rows or abs(way[1]) >= columns:
        return result
    here = tuple(slice(max(0, -w), min(n, n - w)) for w, n in zip(way, z.shape, strict=True))
    there = tuple(slice(max(0, w), min(n, n + w)) for w, n in zip(way, z.shape, strict=True))
    with np.errstate(invalid="ignore"):
        apart = np.maximum(z[there] - z[here], -most)
        apart = np.where(apart > most, most * most / np.maximum(apart, most), apart)
        result[here] = np.where(np.isnan(apart), -most, apart)
    return result
