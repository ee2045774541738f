"""The angle of repose of a heap."""

from __future__ import annotations

import numpy as np

from tisim.errors import must

FLANK = (0.2, 0.8)
"""Between these parts of the height lies the flank, without the foot that runs out and the round top."""
SECTORS = 12
"""The heap is looked at from this many sides."""


def angle_of_repose(
    position: np.ndarray, radius: np.ndarray, centre: tuple[float, float] | None = None, floor: float = 0.0
) -> float:
    """Return the angle (rad) of the flank of a conical heap on a horizontal floor, z upwards.

    The heap is divided in sectors around its axis, and in rings as wide as a mean diameter. The surface in a
    ring is the mean over sectors of the height of the highest point of a grain; a straight line through the
    rings where it is from 0.2 to 0.8 of the height of the heap, by least squares, has the slope. Of a cone of
    some twenty diameters that is right to a degree.

    position : m, shape (n, 3). radius : m, shape (n,). centre : x and y of the axis (m), that of the mass
    unless given. floor : height of the floor (m).
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
    # From the top down to where the foot begins, so that strays do not count.
    low = np.flatnonzero(surface < FLANK[0] * high)
    last = int(low[0]) if len(low) else len(surface)
    flank = np.flatnonzero(surface[:last] <= FLANK[1] * high)
    must(len(flank) >= 3, "flank of the heap", "at least 3 mean diameters wide", len(flank))
    slope = np.polyfit((flank + 0.5) * width, surface[flank], 1)[0]
    return float(np.arctan(-slope))
