"""Alignment of rods: along walls, and the histogram of their directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.errors import is_whole, must
from tisim.geometry.shape import Shape

LARGEST_ANGLE = 4.0
"""Angle between a rod and a wall up to which it is aligned, degrees (B16 Fig. 2.6)."""
GRADIENT_STEP = 1e-6
"""Step of the difference that gives the normal of a wall, relative to the extent of the places."""


class WallAlignment(NamedTuple):
    """Rods near walls.

    near, aligned : number of rods near each wall, and of those that are aligned with it, shape (walls,).
    fraction : f_align of B16, the sum of ``aligned`` over the sum of ``near``; NaN if none are near. A rod in
    a corner is near to two walls and aligned with one at most, unless it lies along their edge.
    with_any : share of the rods near at least one wall that are aligned with at least one.
    """

    near: np.ndarray
    aligned: np.ndarray
    fraction: float
    with_any: float


class DirectionHistogram(NamedTuple):
    """Density of directions in bins of equal solid angle, relative to random directions, for which it is 1.

    cosine : edges of the cosine of the polar angle, shape (c + 1,).
    azimuth : edges of the azimuth, rad, shape (a + 1,).
    density : shape (c, a). deviation : standard deviation in each bin of as many random directions.
    """

    cosine: np.ndarray
    azimuth: np.ndarray
    density: np.ndarray
    deviation: float


def wall_alignment(
    packing: PackedBodies,
    distance: np.ndarray,
    normal: np.ndarray,
    within: float | None = None,
    angle: float = LARGEST_ANGLE,
) -> WallAlignment:
    """Return how many rods near walls are aligned with them: their axis z is at most ``angle`` (degrees) from
    the plane that touches the wall at its point nearest to the centre of the rod.

    distance, normal : distances of the centres of the rods from each wall, m, shape (n, walls), and the unit
        normals of the walls at their nearest points, of either sign, shape (n, walls, 3): both from
        ``wall_distances`` of planes, cylinders and other shapes.
    within : largest distance (m) at which a rod is near to a wall; D of each rod by default.

    Rods at random directions would be aligned to sin(angle), 7 % at 4 degrees; rods that touch a wall cannot
    point away from it, and of these more are.

    Source: B16 section 2.2.5, Fig. 2.6.
    """
    distance, normal = np.asarray(distance, float), np.asarray(normal, float)
    number = len(packing)
    fit = distance.ndim == 2 and len(distance) == number and normal.shape == (*distance.shape, 3)
    rule = f"of shapes ({number}, walls) and ({number}, walls, 3)"
    must(fit and distance.shape[1] > 0, "distance, normal", rule, (distance.shape, normal.shape))
    must(0 < angle < 90, "angle", "between 0 and 90 degrees", angle)
    must(within is None or within > 0, "within", "above 0", within)
    near = distance <= (packing.diameters()[:, None] if within is None else within)
    out = np.abs(np.einsum("na,nwa->nw", packing.axes()[:, 2], normal))
    aligned = near & (out <= np.sin(np.radians(angle)))
    all_near, either = int(near.sum()), int(near.any(axis=1).sum())
    return WallAlignment(
        near.sum(axis=0),
        aligned.sum(axis=0),
        float(aligned.sum() / all_near) if all_near else float("nan"),
        float(aligned.any(axis=1).sum() / either) if either else float("nan"),
    )


def wall_distances(places: np.ndarray, walls: Sequence[Shape]) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances (m) of places (m, shape (n, 3)) from walls such as ``Plane`` and
    ``CylindricalSurface``, shape (n, walls), and the unit normals of the walls at their nearest points, shape
    (n, walls, 3), from differences of the distance."""
    must(len(walls) > 0, "walls", "at least one", len(walls))
    places = np.asarray(places, float)
    step = GRADIENT_STEP * float(np.ptp(places, axis=0).max(initial=0.0)) or GRADIENT_STEP
    distance = np.stack([wall.distances(places) for wall in walls], axis=1)
    normal = np.zeros((*distance.shape, 3))
    for k, wall in enumerate(walls):
        for axis, e in enumerate(np.eye(3)):
            normal[:, k, axis] = wall.distances(places + step * e) - wall.distances(places - step * e)
    size = np.linalg.norm(normal, axis=2, keepdims=True)
    return distance, normal / np.where(size > 0, size, 1.0)


def direction_histogram(
    axes: ArrayLike, bins: tuple[int, int] = (9, 9), folded: bool = True
) -> DirectionHistogram:
    """Return the histogram of the directions of unit vectors ``axes``, shape (n, 3), over the cosine of their
    angle with z, and their azimuth about z from x.

    Rods have no front: a vector counts as its opposite, with a cosine from 0 to 1.
    bins : numbers of bins of the cosine and of the azimuth.
    folded : whether directions that are mirror images in the planes of the axes count as one, so that the
        azimuth is between 0 and 90 degrees as in B16. Otherwise it is between -180 and 180 degrees.

    Source: B16 section 2.5, Fig. 2.15.
    """
    u = np.asarray(axes, float)
    must(len(u) > 0, "axes", "at least one", len(u))
    counts = all(is_whole(one, 1) for one in bins) and len(bins) == 2
    must(counts, "bins", "two whole numbers, at least 1", bins)
    u = np.abs(u) if folded else np.where(u[:, 2:] < 0, -u, u)
    azimuth = np.arctan2(u[:, 1], u[:, 0])
    low, high = (0.0, np.pi / 2) if folded else (-np.pi, np.pi)
    edges = np.linspace(0, 1, bins[0] + 1), np.linspace(low, high, bins[1] + 1)
    number, *_ = np.histogram2d(np.minimum(u[:, 2], 1.0), azimuth, edges)
    cells = bins[0] * bins[1]
    spread = float(np.sqrt((cells - 1) / len(u)))
    return DirectionHistogram(*edges, number * cells / len(u), spread)
