"""Packing fractions: exact in a periodic box, and by sampled points in parts of any packing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import norm

from tisim.analysis.flow_curves import Estimate
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.errors import is_whole, must
from tisim.numerics.statistics import CONFIDENCE

POINTS = 200_000
"""Number of sampled points. A packing fraction of 0.6 then has an interval of +- 0.002."""
TESTS_AT_ONCE = 500_000
"""Pairs of a point and a bounding sphere that are tested at once, which take up to 200 MB."""


class FractionProfile(NamedTuple):
    """Packing fraction in layers between distances from a surface.

    edges : distances, m, shape (k + 1,).
    fraction, half : packing fraction, and half of its 95 % interval, shape (k,); NaN without points.
    points : number of sampled points, shape (k,).
    """

    edges: np.ndarray
    fraction: np.ndarray
    half: np.ndarray
    points: np.ndarray


def packing_fraction(packing: PackedBodies, volume: float | None = None) -> float:
    """Return the volume of all bodies over the volume of the box, or over ``volume`` (m^3) of a container of
    another form that holds all of them. A volume that two bodies overlap in counts twice.

    InputError if the box is open along an axis, beyond which bodies may reach, and no volume is given.

    Source: B16 section 2.2.5.
    """
    must(volume is not None or all(packing.periodic), "periodic", "true along all axes without a volume",
         packing.periodic)  # fmt: skip
    must(volume is None or volume > 0, "volume", "above 0", volume)
    return float(packing.volumes().sum() / (packing.box_volume if volume is None else volume))


def body_at(packing: PackedBodies, points: np.ndarray) -> np.ndarray:
    """Return the index of a body that contains each point (m, shape (m, 3)), -1 in pores, shape (m,).

    Periodic images count. In an overlap the body of the largest index is returned.
    """
    points = np.asarray(points, float)
    found = np.full(len(points), -1)
    if not len(packing) or not len(points):
        return found
    radii, turns = packing.bounding_radii(), packing.turns
    widest = float(radii.max())
    places, index = packing.images(widest)
    tree = cKDTree(places)
    sides = packing.sides
    inside = points - np.floor((points - packing.low) / np.where(sides > 0, sides, np.inf)) * sides
    for some in _parts(tree, inside, widest):
        near = tree.query_ball_point(inside[some], widest)
        count = np.fromiter(map(len, near), int, len(some))
        image = np.fromiter(chain.from_iterable(near), int, int(count.sum()))
        point, body = np.repeat(some, count), index[image]
        away = inside[point] - places[image]
        hit = np.zeros(len(point), bool)
        close = np.flatnonzero((away**2).sum(axis=1) <= radii[body] ** 2)
        local = turns[body[close]].apply(away[close], inverse=True) / packing.scale[body[close], None]
        for k, shape in enumerate(packing.shapes):
            own = packing.shape[body[close]] == k
            hit[close[own]] = shape.contains(local[own])
        np.maximum.at(found, point[hit], body[hit])
    return found


def _parts(tree: cKDTree, points: np.ndarray, reach: float) -> Iterator[np.ndarray]:
    """Yield the indices of points, in parts near to not too many centres."""
    number = tree.query_ball_point(points, reach, return_length=True)
    part = np.cumsum(number) // TESTS_AT_ONCE
    yield from np.split(np.arange(len(points)), np.flatnonzero(np.diff(part)) + 1)


def sampled_fraction(
    packing: PackedBodies,
    region: Callable[[np.ndarray], np.ndarray] | None = None,
    points: int = POINTS,
    seed: int = 0,
) -> Estimate:
    """Return the packing fraction in a region of the box, with half of its 95 % interval.

    region : function of points (m, shape (m, 3)) that returns which of them are in the region; the whole box
        without one. points : number of random points in the box. seed : of these points.

    The share of the points in bodies has a binomial error. A volume that bodies overlap in counts once.
    InputError if fewer than 100 points are in the region.
    """
    sample = _sample(packing, points, seed)
    if region is not None:
        sample = sample[np.asarray(region(sample), bool)]
    must(len(sample) >= 100, "points in the region", "at least 100", len(sample))
    share = float((body_at(packing, sample) >= 0).mean())
    return Estimate(share, float(_half(np.array(share), np.array(len(sample)))))


def fraction_profile(
    packing: PackedBodies,
    distance: Callable[[np.ndarray], np.ndarray],
    edges: np.ndarray,
    points: int = POINTS,
    seed: int = 0,
) -> FractionProfile:
    """Return the packing fraction in layers between distances (m, increasing) from a wall.

    distance : function of points (m, shape (m, 3)) that returns their distances from the wall, m, shape (m,),
        such as ``Plane().distances``. It must be negative behind the wall, or infinite, if the box reaches
        beyond: a ``CylindricalSurface`` has the same distances on both sides.
    points : number of random points in the box. seed : of these points.
    """
    edges = np.asarray(edges, float)
    must(len(edges) > 1 and bool((np.diff(edges) > 0).all()), "edges", "increasing distances", edges)
    sample = _sample(packing, points, seed)
    layer = np.searchsorted(edges, distance(sample), side="right") - 1
    kept = (layer >= 0) & (layer < len(edges) - 1)
    layer, filled = layer[kept], body_at(packing, sample[kept]) >= 0
    number = np.bincount(layer, minlength=len(edges) - 1)
    fraction = np.bincount(layer, filled, len(number)) / np.where(number > 0, number, np.nan)
    return FractionProfile(edges, fraction, _half(fraction, number), number)


def _sample(packing: PackedBodies, points: int, seed: int) -> np.ndarray:
    """Return random points in the box (m), shape (points, 3)."""
    must(is_whole(points, 1), "points", "a whole number, at least 1", points)
    return np.random.default_rng(seed).uniform(packing.low, packing.high, (points, 3))


def _half(share: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Return half of the interval of a share of independent points (E. B. Wilson, J. Am. Stat. Assoc. 22
    (1927) 209), which is above 0 for shares of 0 and 1."""
    z = norm.ppf(0.5 + CONFIDENCE / 2)
    n = np.where(number > 0, number, np.nan)
    return np.asarray(z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n)))
