"""Local thickness of the structures in an image: the width of chains, sheets and gaps."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt

from tisim.errors import is_number, must

FIRST_REACH = 8
"""Distance (pixels) beyond the edges of a periodic image in which the nearest pixel is sought first."""


def local_thickness(image: np.ndarray, spacing: float, periodic: bool = True) -> np.ndarray:
    """Return the local thickness of the structures in an image, m, of its shape; 0 outside of them.

    The thickness at a point is the diameter of the largest disc (in three dimensions, ball) that contains the
    point and lies within the structure. In a straight band it is the width of the band, and in a disc its
    diameter.

    image : bool, true in the structures; two or three dimensions. spacing : side of a pixel, m.
    periodic : whether the image continues periodically at its edges. Otherwise structures continue beyond
        them without limit.

    Radii of discs are multiples of half a pixel, so that thicknesses are exact to a pixel. A structure that
    fills the image has no thickness: the result is infinite. Raises InputError unless the image is bool and
    the spacing above 0.

    Source: T. Hildebrand, P. Rueegsegger, J. Microsc. 185 (1997) 67, Eq. (1).
    """
    image = np.asarray(image)
    flat = image.dtype == bool and image.ndim in (2, 3)
    must(flat, "image", "bool of two or three dimensions", f"{image.dtype} of {image.ndim}")
    must(is_number(spacing) and spacing > 0, "spacing", "a number of m above 0", spacing)
    if image.all():
        return np.full(image.shape, np.inf)
    free, widest = _free_distance(image, periodic), np.zeros(image.shape)
    # Discs are drawn from the largest to the smallest, and each covers the points that are still blank.
    for halves in range(int(2 * free.max()), 0, -1):
        radius = halves / 2
        covered = _distance(free < radius, periodic, halves // 2 + 1) < radius
        widest[covered & (widest == 0)] = 2 * radius
    return np.asarray(spacing * np.where(image, widest, 0.0))


def _free_distance(image: np.ndarray, periodic: bool) -> np.ndarray:
    """Return the distance of each pixel from the nearest one that is false, in pixels, also far away.

    A distance is right if it is at most the reach. Images of all pixels are 27 times as many in three
    dimensions, so that a short reach is tried first.
    """
    reach = FIRST_REACH
    while True:
        free = _distance(image, periodic, reach)
        if free.max() <= reach or reach >= max(image.shape) or not periodic:
            return free
        reach *= 2


def _distance(image: np.ndarray, periodic: bool, reach: int) -> np.ndarray:
    """Return the distance of each pixel from the nearest one that is false, in pixels.

    reach : distance up to which the periodic images of pixels count.
    """
    border = reach if periodic else 0
    whole = distance_transform_edt(np.pad(image, border, mode="wrap" if periodic else "constant"))
    return np.asarray(whole[tuple(slice(border, border + side) for side in image.shape)])
