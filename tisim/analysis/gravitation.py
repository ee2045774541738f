"""Gravitational energy, virial ratio and angular momentum of particles."""

from __future__ import annotations

import numpy as np
from scipy.constants import G

BLOCK_PAIRS = 2**20
"""Number of pairs that are computed at once."""


def gravitational_energy(position: np.ndarray, mass: np.ndarray, softening_length: float = 0.0) -> float:
    """Return the gravitational energy of particles (J), summed over all pairs; negative.

        U = -G sum_(i < j) m_i m_j / (d^2 + eps^2)^(1/2)

    position : m, shape (n, 3). mass : kg, shape (n,). softening_length : eps, m.

    It corresponds to the forces of ``self_gravity`` and ``softened_self_gravity`` without images. The cost is
    proportional to n^2.
    """
    places, mass = np.asarray(position, float), np.asarray(mass, float)
    total, block = 0.0, max(1, BLOCK_PAIRS // max(len(places), 1))
    for begin in range(0, len(places), block):
        some = slice(begin, begin + block)
        apart = places[None, begin:] - places[some, None]
        square = np.einsum("ijk,ijk->ij", apart, apart) + softening_length**2
        # Within the block each pair counts once, with j after i.
        after = np.arange(len(places) - begin) > np.arange(len(places[some]))[:, None]
        inverse = np.divide(1.0, np.sqrt(square), out=np.zeros_like(square), where=after)
        total -= G * float(mass[some] @ inverse @ mass[begin:])
    return total


def virial_ratio(
    position: np.ndarray, velocity: np.ndarray, mass: np.ndarray, softening_length: float = 0.0
) -> float:
    """Return 2 K / |U| of particles bound by their gravity alone. Its time average is 1 in equilibrium; it is
    0 at rest, and above 2 if the particles are unbound.

    K is the kinetic energy relative to the centre of mass, U the ``gravitational_energy``. With a softening
    length the equilibrium value is 1 only if few pairs are closer than that.

    position : m, velocity : m/s, each of shape (n, 3). mass : kg, shape (n,). softening_length : m, as in the
        scene.
    """
    mass = np.asarray(mass, float)
    relative = np.asarray(velocity, float) - np.average(velocity, axis=0, weights=mass)
    kinetic = 0.5 * float(mass @ (relative**2).sum(axis=1))
    return 2 * kinetic / abs(gravitational_energy(position, mass, softening_length))


def angular_momentum(
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
    radius: np.ndarray | None = None,
    spin: np.ndarray | None = None,
) -> np.ndarray:
    """Return the angular momentum of particles about their centre of mass (kg m^2/s), shape (3,).

        L = sum_i (m_i (r_i - r_c) x (v_i - v_c) + 2/5 m_i R_i^2 w_i)

    position : m, velocity : m/s, each of shape (n, 3).
    mass : kg, shape (n,).
    radius, spin : R, m, shape (n,), and angular velocity w, rad/s, shape (n, 3); the spin of spheres is
        included only if both are given.
    """
    mass = np.asarray(mass, float)
    arm = np.asarray(position, float) - np.average(position, axis=0, weights=mass)
    relative = np.asarray(velocity, float) - np.average(velocity, axis=0, weights=mass)
    total = (mass[:, None] * np.cross(arm, relative)).sum(axis=0)
    if spin is not None and radius is not None:
        total = total + ((0.4 * mass * np.asarray(radius, float) ** 2)[:, None] * spin).sum(axis=0)
    return np.asarray(total)
