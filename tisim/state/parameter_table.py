"""One parameter table for all worlds, and the functions through which kernels read it.

For each parameter a bound part (see bound.py) has a function of the world that reads the table. A kernel that
calls ``self.hardness(w)`` gets the value of world w, and loading other designs changes numbers in a table,
not code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.component import Component
from tisim.errors import must
from tisim.state.bound import Bound, Kind


def _reader(table: Any, slot: int, size: int) -> Any:
    if size == 1:

        @ti.func
        def read(w):
            return table[w, slot]

    else:

        @ti.func
        def read(w):
            return ti.Vector([table[w, slot], table[w, slot + 1], table[w, slot + 2]])

    return read


def _row_reader(table: Any, slot: int, size: int, stride: int) -> Any:
    if size == 1:

        @ti.func
        def read(w, k):
            return table[w, slot + k * stride]

    else:

        @ti.func
        def read(w, k):
            at = slot + k * stride
            return ti.Vector([table[w, at], table[w, at + 1], table[w, at + 2]])

    return read


def _length_reader(table: Any, slot: int) -> Any:
    @ti.func
    def read(w):
        return ti.cast(table[w, slot], ti.i32)

    return read


def _width(kind: type[Component]) -> int:
    return sum(size for _, size in kind.columns())


def _slots(part: Component) -> int:
    """Return the number of table slots of a part.

    The slots hold its own parameters, for each list the length and room for the rows, the derived values of
    each row, and the slots of its members.
    """
    room = part.room()
    lists = sum(1 + _width(kind) * room[name] for name, kind in part.lists())
    derived = sum(len(values) for values in part.derived_rows().values())
    return _width(type(part)) + lists + derived + sum(_slots(one) for one in part.members().values())


def _entries(part: Component, where: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the values in the slots of a part, in order, in blocks with one dotted name each."""
    sizes = [size for _, size in part.columns()]
    values = np.array(part.values(), float)
    for (name, size), end in zip(part.columns(), np.cumsum(sizes), strict=True):
        yield f"{where}.{name}", values[end - size : end]
    room = part.room()
    for name, kind in part.lists():
        rows = getattr(part, name)
        yield f"{where}.{name}", np.array([float(len(rows))])
        for k, row in enumerate(rows):
            yield from _entries(row, f"{where}.{name}.{k}")
        yield f"{where}.{name}", np.zeros(_width(kind) * (room[name] - len(rows)))
    for name, derived in part.derived_rows().items():
        yield f"{where}.{name}", np.asarray(derived, float)
    for name, member in part.members().items():
        yield from _entries(member, f"{where}.{name}")


class ParameterTable:
    """The parameter table holds the parameters of all parts and all worlds: ``table[world, slot]``."""

    def __init__(self, parts: Sequence[Component], worlds: int, real: Any) -> None:
        self.slots = sum(_slots(part) for part in parts)
        self.field = ti.field(real)
        builder = Builder()
        builder.dense(ti.i, worlds).dense(ti.j, max(1, self.slots)).place(self.field)
        self.trees = [Tree(builder)]
        self._next, self.array_bytes = 0, 0

    def bind(self, part: Kind) -> Bound[Kind]:
        """Bind a part, the next one in the order of the table, and return the object for kernels."""
        bound, slot = Bound(part), self._next
        for name, size in part.columns():
            setattr(bound, name, _reader(self.field, slot, size))
            slot += size
        room = part.room()
        for name, kind in part.lists():
            setattr(bound, name, self._bind_rows(kind, slot))
            slot += 1 + _width(kind) * room[name]
        for name, derived in part.derived_rows().items():
            setattr(bound, name, _row_reader(self.field, slot, 1, 1))
            slot += len(derived)
        self._next = slot
        for name, member in part.members().items():
            setattr(bound, name, self.bind(member))
        for name, values in part.lookups().items():
            setattr(bound, name, self._place(values))
        return bound

    @in_taichi_thread
    def _place(self, values: np.ndarray) -> Any:
        """Return an array in device memory that holds these values."""
        column, builder = ti.field(self.field.dtype), Builder()
        builder.dense(ti.i, values.shape[0]).dense(ti.j, values.shape[1]).place(column)
        self.trees.append(Tree(builder))
        rounded = values.astype(np.float64 if self.field.dtype == ti.f64 else np.float32)
        column.from_numpy(rounded)
        self.array_bytes += rounded.nbytes
        return column

    def _bind_rows(self, kind: type[Component], slot: int) -> Bound[Any]:
        """Return the object that gives kernels access to all rows of a list."""
        rows, first = Bound(kind.model_construct()), slot + 1
        rows.size = _length_reader(self.field, slot)
        for name, size in kind.columns():
            setattr(rows, name, _row_reader(self.field, first, size, _width(kind)))
            first += size
        return rows

    def write(self, rows: Sequence[Sequence[Component]]) -> None:
        """Set the parameters of each world from its parts, in the order in which they were bound.

        InputError is raised for a value that the precision cannot hold, or that kernels would flush to zero.
        """
        real, precision = (np.float64, "f64") if self.field.dtype == ti.f64 else (np.float32, "f32")
        table = np.ones((self.field.shape[0], max(1, self.slots)), real)
        for world, parts in enumerate(rows):
            entries = [entry for part in parts for entry in _entries(part, part.label)]
            row = np.concatenate([values for _, values in entries]) if entries else np.empty(0)
            rule = f"{self.slots} numbers, as in other scenes of this structure (see Component.room)"
            must(len(row) == self.slots, "parameters with lists and derived_rows", rule, len(row))
            with np.errstate(over="ignore", under="ignore"):
                table[world, : self.slots] = row
            held = table[world, : self.slots]
            flushed = (row != 0) & (np.abs(held) < np.finfo(real).tiny)
            for slot in np.flatnonzero(~np.isfinite(held) | flushed):
                ends = np.cumsum([len(values) for _, values in entries])
                name = entries[int(np.searchsorted(ends, slot, side="right"))][0]
                must(False, name, f"within the range of {precision}", float(row[slot]))
        self._put(table)

    @in_taichi_thread
    def _put(self, values: np.ndarray) -> None:
        self.field.from_numpy(values)
