"""Lattices of touching spheres, and random packings, for tests of measures."""

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.analysis import PackedBodies
from tisim.shapes import SphereShape

CELLS = {
    "sc": ((1, 1, 1), [(0, 0, 0)]),
    "bcc": (3 * (2 / np.sqrt(3),), [(0, 0, 0), (1 / 2, 1 / 2, 1 / 2)]),
    "fcc": (3 * (np.sqrt(2),), [(0, 0, 0), (0, 1 / 2, 1 / 2), (1 / 2, 0, 1 / 2), (1 / 2, 1 / 2, 0)]),
    "hcp": (
        (1, np.sqrt(3), np.sqrt(8 / 3)),
        [(0, 0, 0), (1 / 2, 1 / 2, 0), (1 / 2, 5 / 6, 1 / 2), (0, 1 / 3, 1 / 2)],
    ),
}
"""Sides of the cells in D, and the places within them."""
CONTACTS = {"sc": 6, "bcc": 8, "fcc": 12, "hcp": 12}
FRACTION = {
    "sc": np.pi / 6,
    "bcc": np.pi * np.sqrt(3) / 8,
    "fcc": np.pi / np.sqrt(18),
    "hcp": np.pi / np.sqrt(18),
}


def lattice(name, cells=1, diameter=1.0, shape=None, low=(0.0, 0.0, 0.0)):
    """A periodic box of cells along each axis, of touching spheres unless there is a shape."""
    sides, basis = CELLS[name]
    sides = diameter * np.array(sides)
    steps = np.stack(np.meshgrid(*3 * [np.arange(cells)], indexing="ij"), -1).reshape(-1, 1, 3)
    places = ((steps + np.array(basis)) * sides).reshape(-1, 3) + low
    return PackedBodies.of(shape or SphereShape(diameter=diameter), places, low, low + cells * sides)


def random_packing(rng, shape, number, side, periodic=(True, True, True)):
    """Bodies at random places in random directions, which may overlap."""
    turns = Rotation.random(number, rng=rng).as_quat(scalar_first=True)
    places = rng.uniform(0, side, (number, 3))
    return PackedBodies.of(shape, places, (0, 0, 0), 3 * (side,), turns, periodic=periodic)
