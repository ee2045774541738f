"""The Hilbert curve visits all cells, each next to the one before."""

import numpy as np

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.hilbert import CURVE_BITS, hilbert_index


@in_taichi_thread
@ti.kernel
def _indices(cells: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(cells.shape[0]):
        out[k] = hilbert_index(ti.Vector([cells[k, 0], cells[k, 1], cells[k, 2]]))


def indices(cells):
    out = np.zeros(len(cells), np.int64)
    _indices(np.ascontiguousarray(cells, np.int32), out)
    return out


def test_the_curve_starts_in_a_corner_and_moves_to_neighbours():
    """The first 16^3 positions fill a cube, visit each cell once, and move to a neighbour every time."""
    cells = np.argwhere(np.ones((16, 16, 16)))
    place = indices(cells)
    np.testing.assert_array_equal(np.sort(place), np.arange(16**3))
    ordered = cells[np.argsort(place)]
    assert (ordered[0] == 0).all()
    assert (np.abs(np.diff(ordered, axis=0)).sum(axis=1) == 1).all()


def test_the_curve_is_hierarchical(rng):
    """All bits count: cells share leading bits of their index exactly if they share leading bits of their
    position."""
    cells = rng.integers(0, 1 << CURVE_BITS, (2000, 3))
    place = indices(cells)
    assert place.min() >= 0
    assert place.max() < 1 << 3 * CURVE_BITS
    for level in (1, 2, 5, 9):
        low = CURVE_BITS - level
        cubes = np.unique(np.column_stack([cells >> low, place >> 3 * low]), axis=0)
        assert len(cubes) == len(np.unique(cells >> low, axis=0)) == len(np.unique(place >> 3 * low))
