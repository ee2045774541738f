"""Which solid each pixel shows: a z-buffer that NumPy fills for many solids at once.

Each pixel holds a whole number: the depth in its upper bits, and the index of the solid in its lower ones, so
that one maximum keeps both. Rectangles of pixels are processed from the nearest solid to the farthest, and
those that lie behind all pixels filled so far are skipped: most solids of a dense bed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tisim.rendering.solids import Solids, Splats

INDEX_BITS = 31
"""Bits of the index of a solid; the depth has 32."""
DEPTHS = 2**32 - 2
"""Number of distinguished depths."""
DEPTH_RANGE = 1e6
"""Depths farther than this from the median of the solids are not distinguished, pixels, so that a solid far
behind all others does not make the steps of depth coarse."""
EMPTY = -1
"""Value of a pixel that shows nothing."""
SMALLEST_TILE = 16
"""Side of the smallest tile, pixels."""
TILE_SIZES = 5
"""Number of sizes of tiles, each twice as large as the one before."""
LARGEST_RECTANGLE = SMALLEST_TILE << (TILE_SIZES - 1)
"""Larger rectangles are split, pixels."""
RECTANGLE_SIDES = np.unique(np.rint(LARGEST_RECTANGLE * 2.0 ** (-0.5 * np.arange(17))).astype(int))
"""Sides to which rectangles are enlarged, so that many are processed together, pixels."""
PIXELS_AT_ONCE = 500_000
"""Number of pixels that are tested at a time."""
ACROSS = 1e-9
"""Planes whose normal has a smaller component towards the viewer are parallel to the rays."""
Planes = Sequence[tuple[np.ndarray, float]]
"""Unit normals and offsets of planes; normal . r <= offset is kept."""


@dataclass(frozen=True)
class Layer:
    """The solids that the pixels show.

    solid : index of the solid in each pixel, counted through all groups; -1 for none, shape (rows, columns),
    from the lowest row upwards.
    """

    solid: np.ndarray
    groups: tuple[Solids, ...]

    def visible(self) -> Iterator[tuple[Solids, np.ndarray, np.ndarray]]:
        """Yield each group with the pixels that show it, as flat indices, and the indices of their
        solids."""
        flat, first = self.solid.ravel(), 0
        for group in self.groups:
            pixels = np.flatnonzero((flat >= first) & (flat < first + len(group)))
            if len(pixels):
                yield group, pixels, flat[pixels] - first
            first += len(group)


def layer(
    groups: Sequence[Solids], columns: int, rows: int, planes: Planes = (), farthest: bool = False
) -> Layer:
    """Return the nearest solid in each pixel, or the farthest.

    groups : in pixels (``Solids.seen_on``). planes : cut parts of the solids off. farthest : for surfaces,
        which have no thickness.
    """
    pieces = [_Rectangles.of(group.splats(), columns, rows) for group in groups]
    near = np.concatenate([np.empty(0), *(one.near for one in pieces)])
    far = np.concatenate([np.empty(0), *(one.far for one in pieces)])
    if not len(near):
        return Layer(np.full((rows, columns), EMPTY), tuple(groups))
    middle = float(np.median(np.concatenate([group.centre[:, 2] for group in groups])))
    span = max(float(far.min()), middle - DEPTH_RANGE), min(float(near.max()), middle + DEPTH_RANGE)
    buffer = _Buffer(columns, rows, span, farthest)
    group_of = np.repeat(np.arange(len(groups)), [len(one.solid) for one in pieces])
    row_of = np.concatenate([np.arange(len(one.solid)) for one in pieces])
    area = np.concatenate([one.columns * one.rows for one in pieces])
    first = np.cumsum([0, *(len(group) for group in groups)])
    order = np.argsort(-near, kind="stable")
    block = np.cumsum(area[order]) // (4 * PIXELS_AT_ONCE)
    for members in np.split(order, np.flatnonzero(np.diff(block)) + 1):
        buffer.note_filled_tiles()
        for g, group in enumerate(groups):
            own = pieces[g].where(row_of[members[group_of[members] == g]])
            buffer.add(group, own, int(first[g]), planes)
    return Layer(buffer.solids(), tuple(groups))


def entry(
    group: Solids, k: np.ndarray, x: np.ndarray, y: np.ndarray, planes: Planes
) -> tuple[np.ndarray, np.ndarray]:
    """Return the z at which rays enter solids that planes cut, -inf if they miss, and the index of the plane
    in whose cut they enter, -1 for the surface of the solid."""
    top = group.top(k, x, y)
    cut = np.full(top.shape, -1)
    if not planes:
        return top, cut
    with np.errstate(invalid="ignore"):
        low = group.bottom(k, x, y)
        for number, (normal, offset) in enumerate(planes):
            rest = offset - normal[0] * x - normal[1] * y + 0 * top
            if normal[2] > ACROSS:
                nearer = rest / normal[2] < top
                top, cut = np.where(nearer, rest / normal[2], top), np.where(nearer, number, cut)
            elif normal[2] < -ACROSS:
                low = np.maximum(low, rest / normal[2])
            else:
                low = np.where(rest < 0, np.inf, low)
        return np.where(low <= top, top, -np.inf), cut


@dataclass(frozen=True)
class _Rectangles:
    """Rectangles of pixels within the picture: solid, first column and row, numbers of columns and rows, and
    bounds of z, shape (m,) each."""

    solid: np.ndarray
    column: np.ndarray
    row: np.ndarray
    columns: np.ndarray
    rows: np.ndarray
    near: np.ndarray
    far: np.ndarray

    @classmethod
    def of(cls, splats: Splats, columns: int, rows: int) -> _Rectangles:
        """Return the pixels whose centres are in boxes, without those outside of the picture; large ones are
        split."""
        size = np.array([columns, rows])
        low = np.clip(np.ceil(splats.low[:, :2] - 0.5), 0, size).astype(int)
        high = np.clip(np.floor(splats.high[:, :2] - 0.5) + 1, 0, size).astype(int)
        count = -(-(high - low) // LARGEST_RECTANGLE)
        some = np.flatnonzero((high > low).all(axis=1))
        pieces = count[some].prod(axis=1)
        from_ = np.repeat(some, pieces)
        rank = np.arange(len(from_)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        at = np.stack([rank % count[from_, 0], rank // count[from_, 0]], axis=1)
        begin = low[from_] + LARGEST_RECTANGLE * at
        span = np.minimum(high[from_] - begin, LARGEST_RECTANGLE)
        near, far = splats.high[from_, 2], splats.low[from_, 2]
        return cls(splats.solid[from_], begin[:, 0], begin[:, 1], span[:, 0], span[:, 1], near, far)

    def where(self, kept: np.ndarray) -> _Rectangles:
        return _Rectangles(*(values[kept] for values in vars(self).values()))


class _Buffer:
    """The pixels of a layer while solids are added."""

    def __init__(self, columns: int, rows: int, span: tuple[float, float], farthest: bool) -> None:
        """span : least and largest depth that are distinguished."""
        self.columns, self.rows, self.farthest = columns, rows, farthest
        self.stride = -(-columns // LARGEST_RECTANGLE) * LARGEST_RECTANGLE
        self.keys = np.full((-(-rows // LARGEST_RECTANGLE) * LARGEST_RECTANGLE, self.stride), EMPTY, np.int64)
        # Pixels beyond the picture hide nothing, and nothing shows there.
        self.keys[rows:], self.keys[:, columns:] = np.iinfo(np.int64).max, np.iinfo(np.int64).max
        self.back = span[0]
        self.steps = DEPTHS / max(span[1] - span[0], 1.0)
        self.filled: list[np.ndarray] = []

    def note_filled_tiles(self) -> None:
        """Note up to which depth each tile of each size is filled."""
        if self.farthest:
            return
        shape = self.keys.shape[0] // SMALLEST_TILE, SMALLEST_TILE, self.stride
        filled = self.keys.reshape(shape).min(axis=1).reshape(shape[0], -1, SMALLEST_TILE).min(axis=2)
        self.filled = [filled >> INDEX_BITS]
        for _ in range(TILE_SIZES - 1):
            finer = np.minimum(self.filled[-1][::2], self.filled[-1][1::2])
            self.filled.append(np.minimum(finer[:, ::2], finer[:, 1::2]))

    def depth(self, z: np.ndarray) -> np.ndarray:
        """Return the whole number of a depth."""
        depth: np.ndarray = np.clip((z - self.back) * self.steps, 0, DEPTHS).astype(np.int64)
        return depth

    def open(self, some: _Rectangles) -> np.ndarray:
        """Return whether a solid may be visible in its rectangle: not behind all tiles that it meets."""
        if self.farthest:
            return np.ones(len(some.solid), bool)
        near, hidden = self.depth(some.near), np.zeros(len(some.solid), bool)
        level = (
            np.ceil(np.log2(np.maximum(some.columns, some.rows) / SMALLEST_TILE))
            .clip(0, TILE_SIZES - 1)
            .astype(int)
        )
        for k, filled in enumerate(self.filled):
            own = np.flatnonzero(level == k)
            side = SMALLEST_TILE << k
            left, right = some.column[own] // side, (some.column + some.columns - 1)[own] // side
            low, high = some.row[own] // side, (some.row + some.rows - 1)[own] // side
            least = np.minimum(
                np.minimum(filled[low, left], filled[low, right]),
                np.minimum(filled[high, left], filled[high, right]),
            )
            hidden[own] = near[own] < least
        return ~hidden

    def add(self, group: Solids, some: _Rectangles, first: int, planes: Planes) -> None:
        """Add the solids of a group in rectangles. first : index of its first solid."""
        some = some.where(self.open(some))
        wide, tall = (
            np.searchsorted(RECTANGLE_SIDES, some.columns),
            np.searchsorted(RECTANGLE_SIDES, some.rows),
        )
        kind = wide * len(RECTANGLE_SIDES) + tall
        order = np.argsort(kind, kind="stable")
        for members in np.split(order, np.flatnonzero(np.diff(kind[order])) + 1):
            if not len(members):
                continue
            columns, rows = RECTANGLE_SIDES[wide[members[0]]], RECTANGLE_SIDES[tall[members[0]]]
            at_once = max(1, PIXELS_AT_ONCE // int(columns * rows))
            for begin in range(0, len(members), at_once):
                self._fill(group, some.where(members[begin : begin + at_once]), columns, rows, first, planes)

    def _fill(
        self, group: Solids, some: _Rectangles, columns: int, rows: int, first: int, planes: Planes
    ) -> None:
        """Fill rectangles, all enlarged to the same numbers of columns and rows."""
        column = np.minimum(some.column, self.stride - columns)[:, None, None] + np.arange(columns)
        row = np.minimum(some.row, self.keys.shape[0] - rows)[:, None, None] + np.arange(rows)[:, None]
        pixel, k = row * self.stride + column, some.solid[:, None, None]
        x, y = column + 0.5, row + 0.5
        if group.slow and not self.farthest:
            # Only rays that are not filled in front of the solid.
            seen = (self.keys.reshape(-1)[pixel] >> INDEX_BITS) <= self.depth(some.near)[:, None, None]
            pixel, k, x, y = (np.broadcast_to(one, seen.shape)[seen] for one in (pixel, k, x, y))
        z, _ = entry(group, k, x, y, planes)
        hit = z > -np.inf
        depth = self.depth(z[hit])
        if self.farthest:
            depth = DEPTHS - depth
        solid = np.broadcast_to(k + first, z.shape)[hit]
        np.maximum.at(self.keys.reshape(-1), pixel[hit], (depth << INDEX_BITS) | solid)

    def solids(self) -> np.ndarray:
        """Return the index of the solid in each pixel, -1 for none, shape (rows, columns)."""
        keys = self.keys[: self.rows, : self.columns]
        return np.where(keys == EMPTY, EMPTY, keys & ((1 << INDEX_BITS) - 1))
