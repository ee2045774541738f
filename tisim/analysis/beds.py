"""What positions and radii say of a bed of grains: how much of space they fill, and how many each touches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

FEWEST_CONTACTS = 4
"""A grain with fewer contacts is not held in three dimensions: it rattles."""


def solid_fraction(
    position: np.ndarray, radius: np.ndarray, edges: np.ndarray, area: float, axis: int = 2
) -> np.ndarray:
    """Return the part of the volume that grains fill in each slab between ``edges`` (m, rising) along an
    axis; shape (edges - 1,).

    position : m, shape (n, 3). radius : m, shape (n,). area : that of the container across the axis, m^2.
    Each sphere is cut by the edges: a cap of height h has the volume pi h^2 (3 R - h) / 3.
    """
    centre, radius = np.asarray(position)[:, axis, None], np.asarray(radius, float)[:, None]
    height = np.clip(np.asarray(edges, float) - centre + radius, 0.0, 2 * radius)
    below = np.pi * height**2 * (3 * radius - height) / 3
    return np.asarray(np.diff(below.sum(axis=0)) / (area * np.diff(edges)))


def contacts(
    position: np.ndarray, radius: np.ndarray, gap: float = 0.0, sides: Sequence[float] | None = None
) -> np.ndarray:
    """Return the pairs (i < j) of grains whose surfaces are at most ``gap`` (m) apart, sorted; shape (pairs,
    2).

    sides : those of a box that is periodic (m), 0 along an axis along which it is not.
    """
    places, radius = np.asarray(position, float), np.asarray(radius, float)
    box = None if sides is None else np.asarray(sides, float)
    if box is not None:
        places = np.where(box > 0, places % np.where(box > 0, box, 1.0), places - places.min(axis=0))
    pairs = cKDTree(places, boxsize=box).query_pairs(2 * radius.max() + gap, output_type="ndarray")
    pairs = pairs.reshape(-1, 2)
    apart = places[pairs[:, 1]] - places[pairs[:, 0]]
    if box is not None:
        apart -= np.where(box > 0, box * np.rint(apart / np.where(box > 0, box, 1.0)), 0.0)
    near = np.linalg.norm(apart, axis=1) <= radius[pairs].sum(axis=1) + gap
    return np.asarray(pairs[near][np.lexsort(pairs[near].T[::-1])])


def coordination_numbers(number: int, pairs: np.ndarray) -> np.ndarray:
    """Return how many contacts each of ``number`` grains has, as ``pairs`` (n, 2) say; shape (number,)."""
    return np.bincount(np.asarray(pairs).ravel(), minlength=number)


def mean_coordination(number: int, pairs: np.ndarray, rattlers: bool = True) -> float:
    """Return the mean number of contacts of ``number`` grains; without ``rattlers`` that of the grains that
    have four contacts or more, where none of the others count.

    Source: C. Thornton, Geotechnique 50 (2000) 43, as the mechanical coordination number.
    """
    held, before = np.ones(number, bool), -1
    while not rattlers and held.sum() != before:
        # Who rattles holds nobody.
        before, pairs = int(held.sum()), pairs[held[pairs].all(axis=1)]
        held &= coordination_numbers(number, pairs) >= FEWEST_CONTACTS
    return float(2 * len(pairs) / max(int(held.sum()), 1))
