"""Width of the structures that grains form, and of the gaps between them, seen along the field (L21 Figs 2.7
and 2.9)."""

from typing import NamedTuple

import numpy as np

from tisim.analysis import local_thickness
from tisim.cases.common.magnetorheological_fluid import MICRO
from tisim.cases.mrf_shear.measures import extent
from tisim.domains.domain import Domain
from tisim.scene.initial_state import Arrays

SLICE = 25 * MICRO
"""Thickness of the slice at half the height of a cell in which L21 shows its grains, m."""
PIXEL = 0.25 * MICRO
"""Largest side of a pixel of the image of a slice, m."""


class Widths(NamedTuple):
    """Mean widths in a slice, seen along the field.

    structures, gaps : local thickness of the shadow of the grains and of the area beside it, m: the diameter
    of the largest disc within them, a mean over their points. covered : fraction of the area in the shadow.
    """

    structures: float
    gaps: float
    covered: float


def widths(state: Arrays, domain: Domain, thick: float = SLICE) -> Widths:
    """Return the widths of the structures and gaps of a state, in a slice of a thickness (m)."""
    image, pixel = shadow(state["position"], state["radius"], extent(domain), thick)
    inside, outside = local_thickness(image, pixel), local_thickness(~image, pixel)
    return Widths(float(inside[image].mean()), float(outside[~image].mean()), float(image.mean()))


def shadow(
    position: np.ndarray, radius: np.ndarray, sides: np.ndarray, thick: float
) -> tuple[np.ndarray, float]:
    """Return the shadow of a slice of a cell along z as an image, bool, and the side of a pixel, m.

    A pixel is dark if a sphere lies above or below its centre within the slice. The cell is square, and
    periodic along x and y.

    position : m, shape (n, 3). radius : m, shape (n,). sides : of the cell, m, shape (3,).
    """
    side, height = float(sides[0]), float(sides[2])
    number = int(np.ceil(side / PIXEL))
    centres = (np.arange(number) + 0.5) * side / number
    # The widest section of each sphere within the slice.
    away = np.maximum(np.abs(position[:, 2] - height / 2) - thick / 2, 0.0)
    image = np.zeros((number, number), bool)
    for (x, y, _), section in zip(position, np.maximum(radius**2 - away**2, 0.0), strict=True):
        from_x, from_y = ((centres - one + side / 2) % side - side / 2 for one in (x, y))
        image |= from_x[:, None] ** 2 + from_y**2 < section
    return image, side / number
