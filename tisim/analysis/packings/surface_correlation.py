"""Pair correlation of the surfaces of bodies: how often gaps occur, compared with random bodies."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tisim.analysis.packings.gaps import near_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.shape_integrals import curvature_integrals, surface_areas
from tisim.errors import must


def surface_correlation(packing: PackedBodies, edges: np.ndarray) -> np.ndarray:
    """Return the pair correlation of surfaces G(h): the number of pairs of bodies with a gap h between edges
    (m, increasing from 0 or above), over the mean number of such pairs of bodies with random places and
    orientations; shape (edges - 1,).

    A body b that is placed at random, in a random orientation, has a gap of at most h from body a if its
    centre is in a volume of, on average,

        W(h) = V_a + V_b + (S_a M_b + M_a S_b)/(4 pi) + h (S_a + S_b + M_a M_b/(2 pi))
               + h^2 (M_a + M_b) + 4 pi/3 h^3

    with volumes V, surfaces S and integrals M of the mean curvature. The mean number of pairs between h_1 and
    h_2 is the sum of W(h_2) - W(h_1) over pairs a < b, over the volume of the box. G is 1 at all gaps for
    bodies that are placed independently; for equal spheres it is ``radial_distribution`` at r = D + h. If
    pairs touch, G of the first interval is about proportional to one over its width. All images of other
    bodies count.

    The packing must be periodic along all axes.

    Source: A. Isihara, J. Chem. Phys. 18 (1950) 1446, for W at contact, and Steiner's formula for a gap.
    """
    edges = np.asarray(edges, float)
    rising = len(edges) > 1 and edges[0] >= 0 and all(a < b for a, b in pairwise(edges))
    must(rising, "edges", "rising gaps from 0 or above", edges)
    must(all(packing.periodic), "periodic", "true along all axes", packing.periodic)
    must(len(packing) > 1, "bodies", "at least two", len(packing))
    found = near_gaps(packing, float(edges[-1]))
    others = found.pairs[:, 0] != found.pairs[:, 1]
    number, _ = np.histogram(found.gap[others], edges)
    s, m, n = surface_areas(packing), curvature_integrals(packing), len(packing)
    # Sums over pairs: each body is in n - 1 of them, and products are those of sums without the squares.
    first = (n - 1) * s.sum() + (m.sum() ** 2 - (m**2).sum()) / (4 * np.pi)
    second, third = (n - 1) * m.sum(), 4 / 3 * np.pi * n * (n - 1) / 2
    within = first * edges + second * edges**2 + third * edges**3
    return np.asarray(number / (np.diff(within) / packing.box_volume))
