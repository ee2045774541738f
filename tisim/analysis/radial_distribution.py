"""The radial distribution function: how many neighbours particles have at each distance."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from tisim.analysis.separations import Sides, vectors_of, with_images
from tisim.errors import must


def radial_distribution(
    position: np.ndarray,
    edges: np.ndarray,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    sides: Sides = None,
) -> np.ndarray:
    """Return the radial distribution function g(r) of particles in a box, a mean for each range of distance
    between ``edges`` (m, rising); shape (edges - 1,).

        g = n(r) / (rho 4/3 pi (r_2^3 - r_1^3)),    rho = (N - 1) / V

    n is the mean number of others between distances r_1 and r_2, over particles that are at least the last of
    the edges away from all faces that are not joined: around these the ranges are within the box. So g is 1
    where particles are at random, near faces and far from them. Others outside the box do not count.

    position : m, shape (n, 3). low, high : corners of the box, m; of a sample that has none, those of a box
    inside of it. sides : those along which the box is periodic, as ``near`` takes them.

    Source: M. P. Allen, D. J. Tildesley, Computer Simulation of Liquids (2017), section 8.2.
    """
    position, edges = np.asarray(position, float), np.asarray(edges, float)
    vectors, corner, lengths = vectors_of(sides), np.asarray(low, float), np.subtract(high, low)
    rising = len(edges) > 1 and edges[0] >= 0 and all(a < b for a, b in pairwise(edges))
    must(rising, "edges", "rising distances from 0 or above", edges)
    joined = np.diag(vectors) > 0
    fit = np.allclose(np.diag(vectors)[joined], lengths[joined])
    must(bool(fit), "high - low", "the sides along which the box is periodic", lengths)
    must(bool((2 * edges[-1] <= lengths).all()), "edges", "at most half a side of the box", edges[-1])
    inside = ((position >= low) & (position <= high) | joined).all(axis=1)
    places, number = with_images(position[inside] - corner, edges[-1], sides)
    count = int(number.max(initial=-1)) + 1
    deep = (places[:count] >= edges[-1]) & (places[:count] <= lengths - edges[-1])
    centres = places[:count][(deep | joined).all(axis=1)]
    must(len(centres) > 0, "particles", "farther than the last edge from all open faces, at least one", 0)
    within = cKDTree(centres).count_neighbors(cKDTree(places), edges)
    if edges[0] == 0:
        # Each is at a distance of 0 from itself.
        within[0] = len(centres)
    density = (count - 1) / np.prod(lengths)
    shells = 4 / 3 * np.pi * np.diff(edges**3)
    return np.asarray(np.diff(within) / (len(centres) * density * shells))
