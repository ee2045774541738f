"""Orientational order of packings: nematic order of rods and cubatic order of cubes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.analysis.chains import orientation_tensor
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.errors import must

DIRECTIONS = 100
"""Directions from which the director of cubatic order is sought. For 200 sets of 3 to 400 random orientations
60 and 5000 directions gave the same maximum."""
ASCENTS = 2000
"""Largest number of iterations from one direction; 30 are usual."""


class NematicOrder(NamedTuple):
    """Nematic order parameter and director, a unit vector of arbitrary sign, shape (3,)."""

    order: float
    director: np.ndarray


class RandomOrder(NamedTuple):
    """Mean and standard deviation of order parameters over samples of random orientations."""

    nematic: float
    nematic_deviation: float
    cubatic: float
    cubatic_deviation: float


def nematic_order(axes: np.ndarray) -> NematicOrder:
    """Return the nematic order parameter S of unit vectors ``axes``, shape (n, 3), and its director.

        Q = 1/N sum_i (3/2 e_i (x) e_i - 1/2)                                               (2.11)

    S is the largest eigenvalue of Q: 1 if all axes are parallel. For isotropic axes it is 0 only for many of
    them: at N random axes it is 9/(2 sqrt(10 pi N)) = 0.80/sqrt(N) on average (``random_nematic_order``).
    For rods ``packing.axes()[:, 2]`` are the axes.

    Source: B16 (2.11); P. G. de Gennes, J. Prost, The Physics of Liquid Crystals (1993), section 2.1.
    """
    must(len(axes) > 0, "axes", "at least one", len(axes))
    values, vectors = np.linalg.eigh(1.5 * orientation_tensor(axes) - 0.5 * np.eye(3))
    return NematicOrder(float(values[-1]), np.asarray(vectors[:, -1]))


def random_nematic_order(number: int) -> float:
    """Return the mean of S of ``number`` random axes, 9/(2 sqrt(10 pi N)), to leading order in 1/sqrt(N).

    The elements of Q are then normal, with 5 independent components of variance 3/(10 N), and the mean of the
    largest eigenvalue of such a symmetric matrix without trace is 9/(2 sqrt(3 pi)) standard deviations.
    """
    return float(4.5 / np.sqrt(10 * np.pi * number))


def nematic_orders(packing: PackedBodies) -> tuple[NematicOrder, NematicOrder, NematicOrder]:
    """Return S2 and its director for the axes x, y and z of the bodies.

        S2_j = max over n of 1/N sum_i (3/2 (u_ij . n)^2 - 1/2)                              (4.16)

    The maximum is the largest eigenvalue of ``nematic_order``, so S of rods is the S2 of their z axes.
    Axes of a cube are equal: which of them is x is chance, and cubes in order may have S2 near 0.

    Source: B16 (4.16), after R. D. Batten, F. H. Stillinger, S. Torquato, Phys. Rev. E 81 (2010) 061105.
    """
    axes = packing.axes()
    x, y, z = (nematic_order(axes[:, k]) for k in range(3))
    return x, y, z


def cubatic_order(packing: PackedBodies) -> NematicOrder:
    """Return the cubatic order parameter S4 of the axes u_ij of the bodies, and its director n.

        S4 = max over n of 1/(14 N) sum_ij (35 (u_ij . n)^4 - 30 (u_ij . n)^2 + 3)            (4.17)

    It is 1 if all axes are along three directions; at N random orientations it is about 0.97/sqrt(N) on
    average (``random_order``). As the axes of a body are orthogonal, S4 = 5/2 A - 3/2 with the mean A of
    sum_j (u_ij . n)^4. A is convex, so that steps to the direction of its gradient increase it; they are made
    from ``DIRECTIONS`` directions, in place of the random directions of B16.

    Source: B16 (4.17), after Batten et al. (2010); for the steps E. Kofidis, P. A. Regalia, SIAM J. Matrix
    Anal. Appl. 23 (2002) 863.
    """
    must(len(packing) > 0, "bodies", "at least one", 0)
    return _cubatic_order(packing.axes())


def random_order(number: int, samples: int = 400, seed: int = 0) -> RandomOrder:
    """Return S and S4 of ``number`` random orientations, from random samples: the values at which a packing
    of as many bodies has no order."""
    must(number > 0 and samples > 1, "number, samples", "at least 1 and 2", (number, samples))
    draw = np.random.default_rng(seed)
    found = np.zeros((samples, 2))
    for k in range(samples):
        axes = Rotation.random(number, rng=draw).as_matrix().transpose(0, 2, 1)
        found[k] = nematic_order(axes[:, 2]).order, _cubatic_order(axes).order
    means, deviations = found.mean(axis=0), found.std(axis=0, ddof=1)
    return RandomOrder(*(float(one) for pair in zip(means, deviations, strict=True) for one in pair))


def _cubatic_order(axes: np.ndarray) -> NematicOrder:
    u = axes.reshape(-1, 3)
    squares = np.einsum("na,nb->nab", u, u).reshape(-1, 9)
    # A as a form of the products of the components of n.
    form = squares.T @ squares * (3 / len(u))
    n = _half_sphere(DIRECTIONS)
    before = np.zeros(len(n))
    for _ in range(ASCENTS):
        products = np.einsum("na,nb->nab", n, n).reshape(-1, 9)
        gradient = np.einsum("nab,nb->na", (products @ form).reshape(-1, 3, 3), n)
        value = (gradient * n).sum(axis=1)
        n = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
        if (value - before).max() < 1e-15:
            break
        before = value
    best = int(value.argmax())
    return NematicOrder(float(2.5 * value[best] - 1.5), n[best])


def _half_sphere(count: int) -> np.ndarray:
    """Return evenly distributed directions with z > 0, shape (count, 3)."""
    rank = np.arange(count) + 0.5
    z, angle = 1 - rank / count, np.pi * (1 + np.sqrt(5)) * rank
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
