"""Hilbert's curve goes through all cells, from each to a neighbour."""

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


def test_the_curve_begins_in_a_corner_and_goes_from_cell_to_neighbour():
    """The first 16^3 cells are the cube there; each once, and each beside the one before."""
    cells = np.argwhere(np.ones((16, 16, 16)))
    place = indices(cells)
    np.testing.assert_array_equal(np.sort(place), np.arange(16**3))
    ordered = cells[np.argsort(place)]
    assert (ordered[0] == 0).all()
    assert (np.abs(np.diff(ordered, axis=0)).sum(axis=1) == 1).all()


def test_places_far_along_the_curve_are_in_cubes_of_its_cubes(rng):
    """All bits count: cells that share their leading bits share those of the place, and the others do not."""
    cells = rng.integers(0, 1 << CURVE_BITS, (2000, 3))
    place = indices(cells)
    assert place.min() >= 0
    assert place.max() < 1 << 3 * CURVE_BITS
    for level in (1, 2, 5, 9):
        low = CURVE_BITS - level
        cubes = np.unique(np.column_stack([cells >> low, place >> 3 * low]), axis=0)
        assert len(cubes) == len(np.unique(cells >> low, axis=0)) == len(np.unique(place >> 3 * low))
