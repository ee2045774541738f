"""Synthetic slopes of grains on a lattice."""

import numpy as np

from tisim.cases.avalanche.scene import DIAMETERS

WIDTH = 6
"""Width of the cells of these slopes, in diameters."""


def block(heights, d=DIAMETERS[0]):
    """The state of grains on a cubic lattice, with the given number of layers at each diameter along x."""
    place = [(x, y, z) for x, n in enumerate(heights) for y in range(WIDTH) for z in range(n)]
    n = len(place)
    return {
        "position": (np.array(place) + 0.5) * d, "velocity": np.zeros((n, 3)), "spin": np.zeros((n, 3)),
        "radius": np.full(n, d / 2), "mass": np.ones(n), "id": np.arange(n),
    }  # fmt: skip


def leaning(top, run, d=DIAMETERS[0]):
    """The state of a slope that falls by one diameter in each ``run`` diameters."""
    return block([top - int(x / run) for x in range(int(top * run))], d)
