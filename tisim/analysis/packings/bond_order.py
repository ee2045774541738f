"""Bond-orientational order of packings: how the neighbours of bodies are arranged around them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import sph_harm_y

from tisim.analysis.packings.gaps import near_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.voronoi import voronoi_facets
from tisim.errors import is_whole, must


class Bonds(NamedTuple):
    """Bonds from bodies to their neighbours; each bond is there from both of its bodies.

    body, neighbour : indices of bodies, shape (m,).
    separation : neighbour minus body, m, shape (m, 3).
    weight : weight of each bond, shape (m,).
    """

    body: np.ndarray
    neighbour: np.ndarray
    separation: np.ndarray
    weight: np.ndarray


class BondOrder(NamedTuple):
    """Bond order parameters of one degree.

    local : of the bonds of each body, NaN without neighbours, shape (n,).
    whole : of all bonds together. For B independent random bonds its root mean square is 1/sqrt(B).
    neighbours : number of bonds of each body, shape (n,).
    """

    local: np.ndarray
    whole: float
    neighbours: np.ndarray


def contact_bonds(packing: PackedBodies, gap: float) -> Bonds:
    """Return the bonds between bodies with a gap between surfaces of at most ``gap`` (m), of weight 1. A
    large gap, such as 0.2 to 0.4 of the diameter, takes the first shell of neighbours."""
    near = near_gaps(packing, gap)
    i, j = near.pairs.T
    both = np.concatenate([i, j]), np.concatenate([j, i])
    return Bonds(*both, np.concatenate([near.separation, -near.separation]), np.ones(2 * len(i)))


def voronoi_bonds(packing: PackedBodies) -> Bonds:
    """Return the bonds between bodies whose Voronoi cells have a common facet, weighted by its area.

    The weights change continuously with positions, so that they need no cut-off.

    Source: W. Mickel, S. C. Kapfer, G. E. Schroeder-Turk, K. Mecke, J. Chem. Phys. 138 (2013) 044501.
    """
    return Bonds(*voronoi_facets(packing.position, packing.sides))


def bond_order(number: int, bonds: Bonds, degree: int) -> BondOrder:
    """Return the bond order parameters q_l of ``number`` bodies and Q_l of all bonds together.

        q_l = sqrt(4 pi/(2 l + 1) sum_m |q_lm|^2),    q_lm = sum_j w_j Y_lm(n_j) / sum_j w_j

    n are the directions of bonds and w their weights; the sum is over the bonds of one body, or over all. It
    does not depend on the frame. Touching spheres have

        fcc   q_4 = 0.191  q_6 = 0.575        bcc           q_4 = 0.509  q_6 = 0.629
        hcp   q_4 = 0.097  q_6 = 0.485        icosahedron   q_4 = 0      q_6 = 0.663

    degree : l, even, because bonds have two ends.

    Source: P. J. Steinhardt, D. R. Nelson, M. Ronchetti, Phys. Rev. B 28 (1983) 784.
    """
    must(is_whole(degree, 2) and degree % 2 == 0, "degree", "an even whole number, at least 2", degree)
    x, y, z = np.asarray(bonds.separation, float).T
    polar, azimuth = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    squares, whole = np.zeros(number), 0.0
    total = np.bincount(bonds.body, bonds.weight, number)
    all_weight = float(total.sum())
    with np.errstate(invalid="ignore", divide="ignore"):
        for m in range(degree + 1):
            values = bonds.weight * sph_harm_y(degree, m, polar, azimuth)
            real, imaginary = (np.bincount(bonds.body, part, number) for part in (values.real, values.imag))
            # The terms of m and -m are equal.
            times = 1 if m == 0 else 2
            squares += times * (real**2 + imaginary**2) / total**2
            whole += times * abs(values.sum()) ** 2 / all_weight**2 if all_weight else np.nan
    factor = 4 * np.pi / (2 * degree + 1)
    local = np.sqrt(factor * squares)
    return BondOrder(local, float(np.sqrt(factor * whole)), np.bincount(bonds.body, minlength=number))
