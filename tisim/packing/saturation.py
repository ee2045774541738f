"""What room random sequential addition has left, down to none: the packing is then saturated.

G. Zhang and S. Torquato, Phys. Rev. E 88 (2013) 053312: space is cut into voxels, those that lie wholly
within a diameter of a centre are dropped, and places are tried in the others only. Where tries fail, voxels
are cut in eight. A centre that is uniform in the voxels left is uniform in the room left, so this is the same
process as trying places everywhere, without the tries that cannot succeed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from tisim.geometry import round_box
from tisim.packing.region import Region

FIRST_VOXEL_SIDE = 0.5
"""The side of the first voxels is so long at most, in diameters of a sphere."""
VOXELS_PER_BLOCK = 200_000
"""So many voxels are worked on at once, which bounds the memory that it takes."""
NEAREST_CENTRES = 4
"""So many centres, those nearest to the voxel that it was cut from, are asked whether they cover a voxel;
what is missed for the moment is found in a finer cut."""
MAX_CUTS = 40
"""Voxels are cut so many times at most; their side is then below the rounding of a diameter."""


def fill(
    centres: np.ndarray, count: int, diameter: float, region: Region, generator: np.random.Generator
) -> np.ndarray:
    """Return centres, shape (n, 3), m: those given, and more until there are ``count`` or no room is left."""
    return _Voids(np.asarray(centres, float), diameter, region).fill(count, generator)


class _Voids:
    """The voids are the voxels left. index : their indices, shape (m, 3); voxel k spans index_k step ..
    (index_k + 1) step.

    Places are counted from the lower corner of the region, m.
    """

    def __init__(self, centres: np.ndarray, diameter: float, region: Region) -> None:
        self.diameter, self.region = diameter, region
        self.half, self.rounded = region.side / 2, round_box.ROUND[region.shape]
        # A side of 0 is, for a tree, that of an axis along which nothing is periodic.
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
        # Rounding can put a centre on the upper face, which a periodic tree refuses.
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
        """Return the places of ``tries`` that are free, taken one after another; shape (n, 3), m."""
        voxel = self.index[generator.integers(len(self.index), size=tries)]
        places = (voxel + generator.random((tries, 3))) * self.step
        places = places[round_box.contains(self.rounded, self.half, (places - self.half).T)]
        distance, _ = self.tree.query(places, distance_upper_bound=self.diameter)
        places = places[np.isinf(distance)]
        return places[self._first_come(places)]

    def _first_come(self, places: np.ndarray) -> np.ndarray:
        """Return which places are taken when each, in turn, is taken if no earlier one is within a
        diameter."""
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
        """Cut each voxel in eight, and keep what may hold a further centre."""
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
        """Return the voxels that the nearest centre of a tree does not cover."""
        middle = (index + 0.5) * self.step
        distance, nearest = tree.query(middle, distance_upper_bound=self.diameter)
        close = np.flatnonzero(np.isfinite(distance))
        covered = self._is_covered(middle[close], tree.data[nearest[close]])
        return np.delete(index, close[covered], axis=0)

    def _is_covered(self, middle: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Return whether all of a voxel lies within a diameter of a centre: its farthest corner does."""
        apart = np.abs(middle - centre)
        apart = np.minimum(apart, np.abs(self.box - apart))
        return np.asarray(((apart + self.step / 2) ** 2).sum(axis=-1) < self.diameter**2)

    def _within(self, index: np.ndarray) -> np.ndarray:
        """Return the voxels that reach into the region."""
        gap = np.maximum(np.abs((index + 0.5) * self.step - self.half) - self.step / 2, 0.0)
        return index[round_box.contains(self.rounded, self.half, gap.T)]


def _blocks(items: np.ndarray) -> Iterator[np.ndarray]:
    for begin in range(0, max(len(items), 1), VOXELS_PER_BLOCK):
        yield items[begin : begin + VOXELS_PER_BLOCK]
