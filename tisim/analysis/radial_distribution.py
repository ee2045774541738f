"""The radial distribution function: the density of neighbours as a function of distance."""

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
    """Return the radial distribution function g(r) of particles in a box, averaged over each interval of
    distance between ``edges`` (m, increasing); shape (edges - 1,).

        g = n(r) / (rho 4/3 pi (r_2^3 - r_1^3)),    rho = (N - 1) / V

    n is the mean number of other particles between distances r_1 and r_2. It is averaged over particles
    farther than the last edge from all non-periodic faces, for which all intervals lie within the box. g is
    therefore 1 for random particles, near faces and far from them. Particles outside the box are ignored.

    position : m, shape (n, 3).
    low, high : corners of the box, m; for a sample without a box, corners of a box inside it.
    sides : side lengths of a periodic box, as for ``near``.

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
    must(
        len(centres) > 0,
        "particles",
        "at least one that is farther than the last edge from all open faces",
        0,
    )
    within = cKDTree(centres).count_neighbors(cKDTree(places), edges)
    if edges[0] == 0:
        # Exclude each particle's distance of 0 to itself.
        within[0] = len(centres)
    density = (count - 1) / np.prod(lengths)
    shells = 4 / 3 * np.pi * np.diff(edges**3)
    return np.asarray(np.diff(within) / (len(centres) * density * shells))
