"""Reference diffusion matrices from the papers, over kT/(6 pi eta), and the TEA-HI expansion."""

import numpy as np


def oseen(r, one, other):
    """B16 Eq. (6.9); r is the vector from one sphere to the other."""
    d = np.linalg.norm(r)
    return 6 / (8 * d) * (np.eye(3) + np.outer(r, r) / d**2)


def rotne_prager(r, one, other):
    """Zuk et al. (2014), all three cases."""
    d = np.linalg.norm(r)
    if d <= abs(one - other):
        return np.eye(3) / max(one, other)
    along = np.outer(r, r) / d**2
    if d > one + other:
        squares = one**2 + other**2
        return 6 / (8 * d) * ((1 + squares / (3 * d**2)) * np.eye(3) + (1 - squares / d**2) * along)
    first = (16 * d**3 * (one + other) - ((one - other) ** 2 + 3 * d**2) ** 2) / (32 * d**3)
    return (first * np.eye(3) + 3 * ((one - other) ** 2 - d**2) ** 2 / (32 * d**3) * along) / (one * other)


def matrix(tensor, position, radius):
    """The full matrix with Stokes terms on the diagonal, 1/m, shape (3n, 3n)."""
    n = len(radius)
    full = np.zeros((n, 3, n, 3))
    for i in range(n):
        for j in range(n):
            own = np.eye(3) / radius[i]
            full[i, :, j] = own if i == j else tensor(position[j] - position[i], radius[i], radius[j])
    return full.reshape(3 * n, 3 * n)


def expansion(full):
    """B in z = B g: Geyer and Winter (2009), with common factors computed from one axis."""
    m, n = len(full), len(full) // 3
    own = np.sqrt(np.diag(full))
    rho = full / np.outer(own, own)
    off = rho - np.eye(m)
    eps = np.einsum("iaja->", off.reshape(n, 3, n, 3)) / 3 / (n * (n - 1))
    q = (n - 1) * eps**2 - (n - 2) * eps
    beta = (1 - np.sqrt(1 - q)) / q if q else 0.5
    scale = 1 / np.sqrt(1 + beta**2 * (off**2).sum(axis=1))
    return (own * scale)[:, None] * (np.eye(m) + beta * off)
