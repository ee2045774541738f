"""Lattices of cylinders and spheres, and published or closed forms of their permeability.

Zick and Homsy: J. Fluid Mech. 115 (1982) 13. Sangani and Acrivos, cylinders: Int. J. Multiphase Flow 8 (1982)
193; spheres: 343. Hasimoto: J. Fluid Mech. 5 (1959) 317. Jackson and James: Can. J. Chem. Eng. 64 (1986) 364.
"""

import numpy as np

from tisim.sources import SolidCylinder, SolidSphere

SPHERES = {
    "simple cubic": [(0.0, 0.0, 0.0)],
    "body-centred": [(0.0, 0.0, 0.0), (0.5, 0.5, 0.5)],
    "face-centred": [(0.0, 0.0, 0.0), (0.5, 0.5, 0.0), (0.5, 0.0, 0.5), (0.0, 0.5, 0.5)],
}
"""Centres in a cell of side 1."""
ZICK_HOMSY = {
    ("simple cubic", 0.027): 2.008,
    ("simple cubic", 0.125): 4.292,
    ("simple cubic", 0.216): 7.442,
    ("simple cubic", 0.343): 15.4,
    ("simple cubic", 0.45): 28.1,
    ("simple cubic", 0.5236): 42.1,
    ("body-centred", 0.6802): 162.9,
    ("face-centred", 0.7405): 435.0,
}
"""Drag of a sphere over 6 pi eta a U, by lattice and volume fraction; the last of each lattice touch. Table 2
of Zick and Homsy."""
HASIMOTO = {
    "simple cubic": (1.7601, 1.5593),
    "body-centred": (1.7920, 0.3291),
    "face-centred": (1.7917, 0.3020),
}
"""A and B in 1/K = 1 - A phi^(1/3) + phi - B phi^2, for small phi."""
SANGANI_ACRIVOS = {
    0.05: 15.56,
    0.10: 24.83,
    0.20: 51.53,
    0.30: 102.90,
    0.40: 217.89,
    0.50: 532.55,
    0.60: 1763.0,
}
"""Drag on cylinders of a square array, per length, over eta U, across the cylinders, by volume fraction."""


def spheres(lattice, fraction, shift=(0.0, 0.0, 0.0)):
    """The spheres of a lattice in a cell of side 1."""
    centres = SPHERES[lattice]
    radius = (3 * fraction / (4 * np.pi * len(centres))) ** (1 / 3)
    return [SolidSphere(tuple(np.add(c, shift)), radius) for c in centres]


def sphere_permeability(lattice, fraction, drag):
    """k in units of the square of the side of a cell, from the drag K of a sphere: k = V / (6 pi a K)."""
    number = len(SPHERES[lattice])
    radius = (3 * fraction / (4 * np.pi * number)) ** (1 / 3)
    return 1 / (6 * np.pi * number * radius * drag)


def square(fraction, shift=(0.0, 0.0)):
    """A cylinder along z in a square cell of side 1."""
    return [SolidCylinder((*shift, 0.5), (0.0, 0.0, 1.0), np.sqrt(fraction / np.pi), 3.0)]


def hexagonal(fraction):
    """Two cylinders along z in a cell of 1 by sqrt(3), a hexagonal array."""
    radius = np.sqrt(fraction * np.sqrt(3) / (2 * np.pi))
    centres = [(0.1, 0.2, 0.5), (0.6, 0.2 + np.sqrt(3) / 2, 0.5)]
    return [SolidCylinder(c, (0.0, 0.0, 1.0), radius, 3.0) for c in centres]


def across_hexagonal(fraction):
    """Drag per length over eta U of a cylinder of a hexagonal array, across it, for small phi.

    The expansion of Sangani and Acrivos, with the more precise constant 0.7488 in place of 0.745, of Drummond
    and Tahir (Int. J. Multiphase Flow 10 (1984) 515), which flows along and across an array share.
    """
    return 4 * np.pi / (-0.5 * np.log(fraction) - 0.7488 + fraction - fraction**2 / 4)


def along(fraction, neighbours, terms=12, points=200):
    """k over the area of a cell of flow along a square (4 neighbours) or hexagonal (6) array of cylinders.

    The velocity -r^2/4 + b ln r + sum of r^(m n) cos(m n theta) and its counterpart in 1/r satisfies
    Lap w = -1 and is 0 at the cylinder; the derivative normal to a side of the cell is 0 in least squares.
    The flow rate is integrated over the cell.
    """
    half = 0.5
    wedge = np.pi / neighbours
    area = neighbours * half**2 * np.tan(wedge)
    a = np.sqrt(fraction * area / np.pi)
    b = area / (2 * np.pi)
    theta = wedge * (1 - np.cos(np.pi * (np.arange(points) + 0.5) / points)) / 2
    orders = neighbours * np.arange(1, terms + 1)
    r = half / np.cos(theta)

    def slopes(r, theta):
        """Derivatives by x of the terms of unit size at the corner."""
        corner = half / np.cos(wedge)
        inside, outside = (r / corner) ** (orders[:, None] - 1), (a / r) ** (orders[:, None] + 1)
        damp = (a / corner) ** orders[:, None]
        n = orders[:, None]
        return n / corner * inside * np.cos((n - 1) * theta) + n / a * damp * outside * np.cos(
            (n + 1) * theta
        )

    x = r * np.cos(theta)
    right = x / 2 - b * x / r**2
    c, *_ = np.linalg.lstsq(slopes(r, theta).T, right, rcond=None)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    t = wedge * (nodes + 1) / 2
    total = 0.0
    for angle, weight in zip(t, weights * wedge / 2, strict=True):
        end = half / np.cos(angle)
        s = a + (end - a) * (nodes + 1) / 2
        corner = half / np.cos(wedge)
        terms_ = (s / corner) ** orders[:, None] - (a / corner) ** orders[:, None] * (a / s) ** orders[
            :, None
        ]
        w = -(s**2 - a**2) / 4 + b * np.log(s / a) + (c * np.cos(orders * angle)) @ terms_
        total += weight * (weights * w * s).sum() * (end - a) / 2
    return 2 * neighbours * total / area
