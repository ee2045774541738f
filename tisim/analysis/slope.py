"""The slope of a bed that is inclined to one side, as after an avalanche in a box."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tisim.analysis.heap import FLANK
from tisim.errors import must

FEWEST_COLUMNS = 3
"""Smallest number of columns in a straight piece of a slope."""


class SlopeAngles(NamedTuple):
    """Angles (rad) of the straight pieces of a slope, from top to foot, and the positions (m) of the breaks
    between them."""

    angles: np.ndarray
    breaks: np.ndarray


def surface_profile(
    position: np.ndarray, radius: np.ndarray, along: int = 1, across: int = 0, up: int = 2
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (m) along an axis, a mean diameter apart, and the surface height (m) of a bed there:
    the mean over the transverse axis of the highest point of any grain. Columns without grains are left
    out."""
    r, radius = np.asarray(position, float), np.asarray(radius, float)
    width = 2 * float(radius.mean())
    column, row = (((r[:, axis] - r[:, axis].min()) / width).astype(int) for axis in (along, across))
    tops = np.full((column.max() + 1, row.max() + 1), -np.inf)
    np.maximum.at(tops, (column, row), r[:, up] + radius)
    there = np.isfinite(tops)
    filled = there.any(axis=1)
    height = np.where(there, tops, 0.0).sum(axis=1)[filled] / there.sum(axis=1)[filled]
    place = r[:, along].min() + (np.flatnonzero(filled) + 0.5) * width
    return place, height


def slope_angles(
    place: np.ndarray,
    height: np.ndarray,
    pieces: int = 1,
    floor: float = 0.0,
    part: tuple[float, float] = FLANK,
) -> SlopeAngles:
    """Return the angles of repose of a slope from a least-squares fit of one straight line, or of two lines
    with the best break between them.

    place, height : surface of the slope, as returned by ``surface_profile``, m.
    pieces : 1 or 2.
    floor : height of the floor (m).
    part : fractions of the height above the floor between which the slope is fitted, without its top and
        foot.

    L21 finds two angles in a slope of small magnetised grains, a steeper one at the top.

    Source: L21 section 4.4.2.
    """
    must(pieces in (1, 2), "pieces", "1 or 2", pieces)
    x, h = np.asarray(place, float), np.asarray(height, float) - floor
    taken = (h >= part[0] * h.max()) & (h <= part[1] * h.max())
    x, h = x[taken], h[taken]
    fewest = FEWEST_COLUMNS * pieces
    must(len(x) >= fewest, "slope", f"at least {fewest} mean diameters wide", len(x))
    if pieces == 1:
        slopes, breaks = np.polyfit(x, h, 1)[:1], np.empty(0)
    else:
        between = (
            x[FEWEST_COLUMNS - 1 : -FEWEST_COLUMNS] + x[FEWEST_COLUMNS : len(x) - FEWEST_COLUMNS + 1]
        ) / 2
        fits = [(*_bent(x, h, at), at) for at in between]
        _, slopes, at = min(fits, key=lambda fit: fit[0])
        breaks = np.array([at])
    # Order from the top, on whichever side it is.
    falls = np.polyfit(x, h, 1)[0] < 0
    ordered = slopes if falls else -slopes[::-1]
    return SlopeAngles(np.arctan(-ordered), breaks)


def _bent(x: np.ndarray, h: np.ndarray, at: float) -> tuple[float, np.ndarray]:
    """Return the sum of squared residuals of a line with a break at a position, and its two slopes."""
    columns = np.column_stack([np.ones_like(x), x - at, np.maximum(x - at, 0.0)])
    line = np.linalg.lstsq(columns, h, rcond=None)[0]
    off = columns @ line - h
    return float(off @ off), np.array([line[1], line[1] + line[2]])
