"""Copies between fields and arrays, with one kernel for many fields.

Taichi's own copies are a kernel for each field and direction, and a kernel takes some 50 ms to compile. In a
simulation of two particles they took ten times as long as the kernels of its steps.
"""

import math
from collections.abc import Mapping
from itertools import groupby
from typing import Any

import numpy as np

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread

UNROLL_LIMIT = 32
"""Largest number of entries that Taichi unrolls without a warning."""
TYPES = {ti.f32: np.float32, ti.f64: np.float64, ti.i32: np.int32, ti.i64: np.int64}


def _divide(entries: tuple[Any, ...]) -> tuple[tuple[Any, ...], ...]:
    return tuple(entries[k : k + UNROLL_LIMIT] for k in range(0, len(entries), UNROLL_LIMIT))


@ti.data_oriented
class Exchange:
    """An exchange copies a set of fields, scalars or vectors, by name."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        kinds, sizes, placed = list(TYPES), dict.fromkeys(TYPES, 0), []
        self.places: dict[str, tuple[int, slice, tuple[int, ...]]] = {}
        for name, column in columns.items():
            parts = getattr(column, "n", 1)
            shape = (*column.shape, parts) if parts > 1 else tuple(column.shape)
            begin, kind = sizes[column.dtype], kinds.index(column.dtype)
            for k in range(parts):
                part = column.get_scalar_field(k) if parts > 1 else column
                placed.append((tuple(column.shape), kind, part, begin + k, parts))
            sizes[column.dtype] += math.prod(shape)
            self.places[name] = kind, slice(begin, sizes[column.dtype]), shape
        self.sizes = sizes
        placed.sort(key=lambda entry: entry[0])
        groups = [(shape, tuple(entry[1:] for entry in of)) for shape, of in groupby(placed, lambda e: e[0])]
        self.groups = tuple((shape, _divide(entries)) for shape, entries in groups)

    def _buffers(self) -> tuple[np.ndarray, ...]:
        """Return one array for each type; no array may be empty."""
        return tuple(np.empty(max(1, self.sizes[dtype]), kind) for dtype, kind in TYPES.items())

    def _views(self, buffers: tuple[np.ndarray, ...]) -> dict[str, np.ndarray]:
        return {
            name: buffers[kind][where].reshape(shape) for name, (kind, where, shape) in self.places.items()
        }

    def read(self) -> dict[str, np.ndarray]:
        """Return every field as an array of its full shape."""
        buffers = self._buffers()
        self._launch(True, buffers)
        return self._views(buffers)

    def write(self, values: Mapping[str, Any]) -> None:
        """Set every field, from arrays of their full shapes or single numbers."""
        buffers = self._buffers()
        for name, view in self._views(buffers).items():
            view[...] = values[name]
        self._launch(False, buffers)

    @in_taichi_thread
    def _launch(self, reads: bool, buffers: tuple[np.ndarray, ...]) -> None:
        self._copy(reads, *buffers)
        ti.sync()

    @ti.func
    def _at(self, shape: ti.template(), where):  # type: ignore[valid-type]
        """Return the index of an entry in a flat array of this shape."""
        at = where[0]
        for axis in ti.static(range(1, len(shape))):
            at = at * shape[axis] + where[axis]
        return at

    @ti.kernel
    def _copy(
        self,
        reads: ti.template(),  # type: ignore[valid-type]
        f32: ti.types.ndarray(),  # type: ignore[valid-type]
        f64: ti.types.ndarray(),  # type: ignore[valid-type]
        i32: ti.types.ndarray(),  # type: ignore[valid-type]
        i64: ti.types.ndarray(),  # type: ignore[valid-type]
    ):
        """Copy from the fields to the arrays if ``reads``, else from the arrays to the fields."""
        for group in ti.static(self.groups):
            for where in ti.grouped(group[1][0][0][1]):
                at = self._at(group[0], where)
                for entries in ti.static(group[1]):
                    for entry in ti.static(entries):
                        buffer = ti.static((f32, f64, i32, i64)[entry[0]])
                        if ti.static(reads):
                            buffer[entry[2] + at * entry[3]] = entry[1][where]
                        else:
                            entry[1][where] = buffer[entry[2] + at * entry[3]]
