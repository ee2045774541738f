"""Local thickness of the structures in an image: the width of chains, sheets and gaps."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt

from tisim.errors import is_number, must


def local_thickness(image: np.ndarray, spacing: float, periodic: bool = True) -> np.ndarray:
    """Return the local thickness of the structures in an image, m, of its shape; 0 outside of them.

    The thickness at a point is the diameter of the largest disc (in three dimensions, ball) that contains the
    point and lies within the structure. In a straight band it is the width of the band, and in a disc its
    diameter.

    image : bool, true in the structures; two or three dimensions. spacing : side of a pixel, m.
    periodic : whether the image continues periodically at its edges. Otherwise structures continue beyond
        them without limit.

    Diameters are even numbers of pixels. A structure that fills a periodic image has no thickness: the result
    is infinite. Raises InputError unless the image is bool and the spacing above 0.

    Source: T. Hildebrand, P. Rueegsegger, J. Microsc. 185 (1997) 67, Eq. (1).
    """
    image = np.asarray(image)
    must(
        image.dtype == bool and image.ndim in (2, 3), "image", "bool of two or three dimensions", image.dtype
    )
    must(is_number(spacing) and spacing > 0, "spacing", "a number of m above 0", spacing)
    if image.all():
        return np.full(image.shape, np.inf)
    # Half of an image on each side: no disc that avoids the images of a point is wider.
    border = [side // 2 if periodic else 0 for side in image.shape]
    whole = np.pad(image, [(width, width) for width in border], mode="wrap" if periodic else "edge")
    free, widest = distance_transform_edt(whole), np.zeros(whole.shape)
    # Discs are drawn from the largest to the smallest, and each colours the points that are still blank.
    for radius in range(int(free.max()), 0, -1):
        covered = distance_transform_edt(free < radius) < radius
        widest[covered & whole & (widest == 0)] = 2 * radius
    middle = tuple(slice(width, width + side) for width, side in zip(border, image.shape, strict=True))
    return np.asarray(spacing * widest[middle])
