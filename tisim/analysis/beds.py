"""Analysis of beds of grains from positions and radii: solid fraction, contacts and coordination numbers."""

from __future__ import annotations

import numpy as np

from tisim.analysis.separations import Sides, near, nearest_image

FEWEST_CONTACTS = 4
"""A grain with fewer contacts is not held in three dimensions: it is a rattler."""


def solid_fraction(
    position: np.ndarray, radius: np.ndarray, edges: np.ndarray, area: float, axis: int = 2
) -> np.ndarray:
    """Return the fraction of volume that grains fill in each slab between ``edges`` (m, increasing) along an
    axis; shape (edges - 1,).

    position : m, shape (n, 3).
    radius : m, shape (n,).
    area : cross-section of the container normal to the axis, m^2.

    Each sphere is cut at the edges: a cap of height h has the volume pi h^2 (3 R - h) / 3.
    """
    centre, radius = np.asarray(position)[:, axis, None], np.asarray(radius, float)[:, None]
    height = np.clip(np.asarray(edges, float) - centre + radius, 0.0, 2 * radius)
    below = np.pi * height**2 * (3 * radius - height) / 3
    return np.asarray(np.diff(below.sum(axis=0)) / (area * np.diff(edges)))


def contacts(position: np.ndarray, radius: np.ndarray, gap: float = 0.0, sides: Sides = None) -> np.ndarray:
    """Return the pairs (i < j) of grains with a gap between surfaces of at most ``gap`` (m), sorted; shape
    (pairs, 2).

    sides : side lengths of a periodic box, as for ``near``.
    """
    return near(position, np.asarray(radius, float) + gap / 2, sides)


def largest_overlap(position: np.ndarray, radius: np.ndarray, sides: Sides = None) -> float:
    """Return the largest overlap of two grains, m; 0 if none touch.

    sides : side lengths of a periodic box, as for ``near``.
    """
    radius = np.asarray(radius, float)
    i, j = contacts(position, radius, sides=sides).T
    apart = np.linalg.norm(nearest_image(position[j] - position[i], sides), axis=1)
    return float((radius[i] + radius[j] - apart).max(initial=0.0))


def coordination_numbers(number: int, pairs: np.ndarray) -> np.ndarray:
    """Return the number of contacts of each of ``number`` grains, given ``pairs`` (n, 2); shape (number,)."""
    return np.bincount(np.asarray(pairs).ravel(), minlength=number)


def rattling(number: int, pairs: np.ndarray, fewest: int = FEWEST_CONTACTS) -> np.ndarray:
    """Return which of ``number`` grains are rattlers: grains with fewer than ``fewest`` contacts with
    non-rattlers; shape (number,).

    Source: C. Thornton, Geotechnique 50 (2000) 43.
    """
    held, before = np.ones(number, bool), -1
    while held.sum() != before:
        # Contacts with rattlers do not count.
        before, pairs = int(held.sum()), pairs[held[pairs].all(axis=1)]
        held &= coordination_numbers(number, pairs) >= fewest
    return ~held


def mean_coordination(number: int, pairs: np.ndarray, rattlers: bool = True) -> float:
    """Return the mean number of contacts of ``number`` grains. Without ``rattlers``, rattlers and their
    contacts are left out.

    Source: C. Thornton, Geotechnique 50 (2000) 43, as the mechanical coordination number.
    """
    held = np.ones(number, bool) if rattlers else ~rattling(number, pairs)
    return float(2 * held[pairs].all(axis=1).sum() / max(int(held.sum()), 1))
