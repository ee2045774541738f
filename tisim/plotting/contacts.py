"""A figure of the contacts of grains: coordination numbers and contact directions."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections import PolarAxes
from matplotlib.ticker import MaxNLocator

from tisim.analysis import coordination_numbers, fabric_tensor
from tisim.analysis.separations import Sides, nearest_image
from tisim.errors import must
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain

ROSE_SECTORS = 24
"""Number of sectors of a rose diagram."""


def fabric(
    position: np.ndarray, pairs: np.ndarray, sides: Sides = None, plane: tuple[int, int] = (0, 1)
) -> Figure:
    """Draw the distribution of contact numbers as fractions of all grains, and a rose diagram of contact
    directions in the plane of two axes (0 to 2 for x to z) with the density given by the fabric tensor.

        E(theta) = 1 + 2 (F_aa - F_bb) cos(2 theta) + 4 F_ab sin(2 theta),    F_aa + F_bb = 1

    E is the density of directions relative to isotropic contacts. Each contact is weighted by the squared
    in-plane component of its direction, so F is the in-plane part, normalised, of the fabric tensor of all
    contacts.

    position : m, shape (n, 3).
    pairs : pairs in contact, shape (m, 2).
    sides : side lengths of a periodic box.

    InputError if there are no pairs, or the axes are invalid.

    Source: L. Rothenburg and R. J. Bathurst, Geotechnique 39 (1989) 601.
    """
    must({*plane} in ({0, 1}, {0, 2}, {1, 2}), "plane", "two of 0, 1, 2", plane)
    must(len(pairs) > 0, "pairs", "at least one", len(pairs))
    figure = empty(8.0, 3.6)
    bars, rose = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="polar")
    assert isinstance(rose, PolarAxes)
    numbers = np.bincount(coordination_numbers(len(position), pairs))
    bars.bar(np.arange(len(numbers)), numbers / len(position), width=0.8, color=AXIS_COLOURS[0])
    bars.set(xlabel="contacts of a grain", ylabel="fraction of grains")
    bars.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    plain(bars)
    apart = nearest_image(position[pairs[:, 1]] - position[pairs[:, 0]], sides)
    a, b = (apart / np.linalg.norm(apart, axis=1, keepdims=True))[:, plane].T
    both = np.concatenate([np.arctan2(b, a), np.arctan2(-b, -a)])
    edges = np.linspace(-np.pi, np.pi, ROSE_SECTORS + 1)
    density, _ = np.histogram(both, edges, weights=np.tile(a**2 + b**2, 2), density=True)
    middle = (edges[1:] + edges[:-1]) / 2
    rose.bar(middle, 2 * np.pi * density, width=2 * np.pi / ROSE_SECTORS, color=AXIS_COLOURS[0], alpha=0.6)
    theta = np.linspace(-np.pi, np.pi, 361)
    smooth = planar_density(fabric_tensor(position, pairs, sides), plane, theta)
    # For strong anisotropy the two-term expansion becomes negative and is meaningless there.
    rose.plot(theta, np.maximum(smooth, 0.0), color=AXIS_COLOURS[1])
    rose.set_yticks([1.0])
    rose.set_xticks(np.pi / 2 * np.arange(4), [f"{sign}{'xyz'[k]}" for sign in ("", "-") for k in plane])
    rose.set_title("density of directions")
    letters((bars, rose))
    return figure


def planar_density(tensor: np.ndarray, plane: tuple[int, int], theta: np.ndarray) -> np.ndarray:
    """Return E at angles (rad) from the first axis of a plane to the second, for a fabric tensor (3, 3)."""
    within = tensor[np.ix_(plane, plane)] / tensor[plane, plane].sum()
    return np.asarray(
        1 + 2 * (within[0, 0] - within[1, 1]) * np.cos(2 * theta) + 4 * within[0, 1] * np.sin(2 * theta)
    )
