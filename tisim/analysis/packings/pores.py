"""Pores of a packing as an image of voxels, and the sizes of these pores."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tisim.analysis.local_thickness import local_thickness
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import body_at
from tisim.errors import must

SPACING_TOLERANCE = 0.01
"""Largest relative difference between the sides of voxels along the axes."""


class PoreSizes(NamedTuple):
    """Distribution of the pore sizes by volume.

    diameter : diameters of the largest spheres that fit, m, increasing, shape (k,).
    share : part of the volume of the pores in which the largest sphere that contains a point, without
    touching a body, has this diameter, shape (k,).
    """

    diameter: np.ndarray
    share: np.ndarray

    @property
    def mean(self) -> float:
        """Return the mean pore diameter, m, by volume."""
        return float(self.diameter @ self.share)

    def quantile(self, part: float) -> float:
        """Return the diameter (m) at or below which this part of the volume of the pores lies."""
        must(0 <= part <= 1, "part", "from 0 to 1", part)
        first = int(np.searchsorted(np.cumsum(self.share), part * (1 - 1e-12)))
        return float(self.diameter[min(first, len(self.diameter) - 1)])


def pore_image(packing: PackedBodies, spacing: float) -> np.ndarray:
    """Return an image of the pores in the box, bool, true at voxels whose centres are in no body.

    spacing : side of a voxel, m, which is adapted to the sides of the box. InputError if the sides of voxels
        along the axes would then differ by more than 1 %: take a smaller spacing.

    A sphere of 10 voxels across has the volume of the sphere to about 1 %.
    """
    lengths = packing.high - packing.low
    must(spacing > 0, "spacing", "above 0", spacing)
    numbers = np.maximum(np.round(lengths / spacing), 1).astype(int)
    found = lengths / numbers
    even = bool(found.max() <= (1 + SPACING_TOLERANCE) * found.min())
    must(even, "sides of voxels", "equal within 1 % along all axes", found)
    axes = [packing.low[k] + found[k] * (np.arange(numbers[k]) + 0.5) for k in range(3)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(body_at(packing, centres).reshape(numbers) < 0)


def pore_sizes(packing: PackedBodies, spacing: float) -> PoreSizes:
    """Return the distribution of pore sizes: at each point of the pores, the diameter of the largest sphere
    that contains the point and no part of a body (``local_thickness`` of the pores).

    spacing : side of a voxel, m. A diameter is right to about two voxels, and the mean is better: in a cubic
        lattice of spheres of 10, 20 and 40 voxels across it is 0.49, 0.54 and 0.55 of D, with standard
        deviations up to 0.03 for random places of the lattice among the voxels.
    Spheres may reach through the faces of a box that is periodic along all axes. Any other box is taken as if
    it were open along all axes, with free space beyond.

    Source: L. D. Gelb, K. E. Gubbins, Langmuir 15 (1999) 305.
    """
    pores = pore_image(packing, spacing)
    must(not pores.all(), "bodies", "in the box, which is empty", len(packing))
    must(bool(pores.any()), "pores", "wider than a voxel", 0)
    side = float((packing.high - packing.low)[0] / pores.shape[0])
    thickness = local_thickness(pores, side, periodic=all(packing.periodic))[pores]
    diameter, number = np.unique(thickness, return_counts=True)
    return PoreSizes(diameter, number / number.sum())
