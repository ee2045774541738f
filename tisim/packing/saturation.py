"""Completion of random sequential addition up to saturation, when no space is left.

G. Zhang and S. Torquato, Phys. Rev. E 88 (2013) 053312. Space is divided into voxels. Voxels that lie
completely within a diameter of a centre are dropped, and insertion trials are made in the others only. If
trials fail, each voxel is split into eight. A trial position that is uniform in the remaining voxels and
succeeds is uniform in the remaining free space. The process is therefore equivalent to trials everywhere,
without those that cannot succeed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from tisim.geometry import round_box
from tisim.packing.region import Region

FIRST_VOXEL_SIDE = 0.5
"""Largest side of the first voxels, in sphere diameters."""
VOXELS_PER_BLOCK = 200_000
"""Number of voxels processed at once, which limits the memory."""
NEAREST_CENTRES = 4
"""Number of nearest centres that are tested for covering a voxel; voxels missed by this test are found after
further splitting."""
MAX_CUTS = 40
"""Largest number of splittings; the side of a voxel is then below the rounding error of a diameter."""


def fill(
    centres: np.ndarray, count: int, diameter: float, region: Region, generator: np.random.Generator
) -> np.ndarray:
    """Return centres, shape (n, 3), m: the given ones, and more until there are ``count`` or no space is
    left."""
    return _Voids(np.asarray(centres, float), diameter, region).fill(count, generator)


class _Voids:
    """The remaining voxels.

    index : indices of voxels, shape (m, 3); voxel k spans index_k step .. (index_k + 1) step.

    Positions are relative to the lower corner of the region, m.
    """

    def __init__(self, centres: np.ndarray, diameter: float, region: Region) -> None:
        self.diameter, self.region = diameter, region
        self.half, self.rounded = region.side / 2, round_box.ROUND[region.shape]
        # A periodic tree takes a side of 0 as a non-periodic axis.
        self.box = np.where(region.periodic, region.side, 0.0)
        self.places = centres - region.low
        self.tree = self._tree(self.places)
        dims = np.maximum(np.ceil(region.side / (FIRST_VOXEL_SIDE * diameter)), 1).astype(int)
        self.step = region.side / dims
        self.index = np.concatenate([
            self._outside(self._within(np.stack(np.unravel_index(block, dims), axis=1)), self.tree)
            for block in _blocks(np.arange(np.prod(dims)))
        ])  # fmt: skip

    def _tree(self, places: np.ndarray) -> cKDTree:
        # Rounding can put a centre on the upper face, which a periodic tree does not accept.
        inside = np.where(self.region.periodic, places % self.region.side, places)
        return cKDTree(inside, boxsize=self.box if self.box.any() else None)

    def fill(self, count: int, generator: np.random.Generator) -> np.ndarray:
        for _ in range(MAX_CUTS):
            while len(self.index) and len(self.places) < count:
                tries = len(self.index)
                new = self._try(tries, generator)[: count - len(self.places)]
                if len(new):
                    self._add(new)
                if len(new) < 0.2 * tries:
                    break
            if not len(self.index) or len(self.places) >= count:
                break
            self._split_cells()
        return self.region.low + self.places

    def _try(self, tries: int, generator: np.random.Generator) -> np.ndarray:
        """Return the free positions among ``tries`` random ones, accepted in order; shape (n, 3), m."""
        voxel = self.index[generator.integers(len(self.index), size=tries)]
        places = (voxel + generator.random((tries, 3))) * self.step
        places = places[round_box.contains(self.rounded, self.half, (places - self.half).T)]
        distance, _ = self.tree.query(places, distance_upper_bound=self.diameter)
        places = places[np.isinf(distance)]
        return places[self._first_come(places)]

    def _first_come(self, places: np.ndarray) -> np.ndarray:
        """Return which positions are accepted, in order, if no earlier accepted one is within a diameter."""
        accepted = np.ones(len(places), dtype=bool)
        if len(places):
            pairs = self._tree(places).query_pairs(self.diameter, output_type="ndarray")
            for i, j in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].tolist():
                if accepted[i]:
                    accepted[j] = False
        return accepted

    def _add(self, new: np.ndarray) -> None:
        self.places = np.concatenate([self.places, new])
        self.tree = self._tree(self.places)
        added = self._tree(new)
        self.index = np.concatenate([self._outside(block, added) for block in _blocks(self.index)])

    def _split_cells(self) -> None:
        """Split each voxel into eight, and keep those that may hold a further centre."""
        parents, coarse = self.index, self.step
        self.step = coarse / 2
        eighths = np.indices((2, 2, 2)).reshape(3, -1).T
        reach = self.diameter + float(np.linalg.norm(coarse)) / 2
        children = []
        for block in _blocks(parents):
            _, near = self.tree.query((block + 0.5) * coarse, k=NEAREST_CENTRES, distance_upper_bound=reach)
            index = 2 * block[:, None, :] + eighths
            middle = (index + 0.5) * self.step
            uncovered = np.ones(index.shape[:2], dtype=bool)
            for k in range(NEAREST_CENTRES):
                there = near[:, k] < len(self.places)
                uncovered[there] &= ~self._is_covered(middle[there], self.places[near[there, k], None, :])
            children.append(self._within(index[uncovered]))
        self.index = np.concatenate(children)

    def _outside(self, index: np.ndarray, tree: cKDTree) -> np.ndarray:
        """Return the voxels that are not covered by their nearest centre in a tree."""
        middle = (index + 0.5) * self.step
        distance, nearest = tree.query(middle, distance_upper_bound=self.diameter)
        close = np.flatnonzero(np.isfinite(distance))
        covered = self._is_covered(middle[close], tree.data[nearest[close]])
        return np.delete(index, close[covered], axis=0)

    def _is_covered(self, middle: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Return whether a whole voxel, and so its farthest corner, lies within a diameter of a centre."""
        apart = np.abs(middle - centre)
        apart = np.minimum(apart, np.abs(self.box - apart))
        return np.asarray(((apart + self.step / 2) ** 2).sum(axis=-1) < self.diameter**2)

    def _within(self, index: np.ndarray) -> np.ndarray:
        """Return the voxels that overlap the region."""
        gap = np.maximum(np.abs((index + 0.5) * self.step - self.half) - self.step / 2, 0.0)
        return index[round_box.contains(self.rounded, self.half, gap.T)]


def _blocks(items: np.ndarray) -> Iterator[np.ndarray]:
    for begin in range(0, max(len(items), 1), VOXELS_PER_BLOCK):
        yield items[begin : begin + VOXELS_PER_BLOCK]
