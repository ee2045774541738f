"""The angle of repose of a heap."""

from __future__ import annotations

import numpy as np

from tisim.errors import must

FLANK = (0.2, 0.8)
"""The flank lies between these fractions of the height, without the foot and the rounded top."""
SECTORS = 12
"""Number of sectors into which the heap is divided."""


def angle_of_repose(
    position: np.ndarray, radius: np.ndarray, centre: tuple[float, float] | None = None, floor: float = 0.0
) -> float:
    """Return the angle (rad) of the flank of a conical heap on a horizontal floor, z upwards.

    The heap is divided into sectors around its axis and into rings with the width of a mean diameter. The
    surface height in a ring is the mean over sectors of the highest point of any grain. The angle is the
    slope of a least-squares line through the rings with a surface height of 0.2 to 0.8 times the height of
    the heap. For a cone about twenty diameters wide the error is about a degree.

    position : m, shape (n, 3). radius : m, shape (n,).
    centre : x and y of the axis (m); by default the centre of mass.
    floor : height of the floor (m).
    """
    r, radius = np.asarray(position, float), np.asarray(radius, float)
    axis = np.average(r[:, :2], axis=0, weights=radius**3) if centre is None else np.asarray(centre)
    x, y = (r[:, :2] - axis).T
    width = 2 * float(radius.mean())
    ring = (np.hypot(x, y) / width).astype(int)
    sector = ((np.arctan2(y, x) / (2 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
    tops = np.full((ring.max() + 1, SECTORS), floor)
    np.maximum.at(tops, (ring, sector), r[:, 2] + radius)
    surface = tops.mean(axis=1) - floor
    high = surface.max()
    # From the top down to the foot, so that scattered grains do not count.
    low = np.flatnonzero(surface < FLANK[0] * high)
    last = int(low[0]) if len(low) else len(surface)
    flank = np.flatnonzero(surface[:last] <= FLANK[1] * high)
    must(len(flank) >= 3, "flank of the heap", "at least 3 mean diameters wide", len(flank))
    slope = np.polyfit((flank + 0.5) * width, surface[flank], 1)[0]
    return float(np.arctan(-slope))
