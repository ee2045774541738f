"""From plain data to what kernels see: one parameter table for all worlds.

A bound copy of a Spec has, in place of each parameter, a function of the world that reads the table. So a
kernel written ``self.hardness(w)`` sees the value of world w, and loading other designs changes numbers in
a table, not code.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from tisim._taichi import ti
from tisim.errors import must
from tisim.spec import Spec

Part = TypeVar("Part", bound=Spec)


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


class Table:
    """The parameters of every part of a scene, for every world: ``table[world, slot]``."""

    def __init__(self, parts: Sequence[Spec], worlds: int, real: Any) -> None:
        self.slots = sum(size for part in parts for _, _, size in part.parameters())
        self.field = ti.field(real)
        builder = ti.FieldsBuilder()
        builder.dense(ti.i, worlds).dense(ti.j, max(1, self.slots)).place(self.field)
        self._tree = builder.finalize()
        self._next = 0

    def bind(self, part: Part) -> Part:
        """A copy of a part, of the same class, whose parameters are functions of the world."""
        bound = part.model_copy()
        for name, _, size in part.parameters():
            bound.__dict__[name] = _reader(self.field, self._next, size)
            self._next += size
        return bound

    def write(self, rows: Sequence[Sequence[Spec]]) -> None:
        """Set the parameters of each world from its parts, in the order they were bound.

        InputError for one that the precision cannot hold.
        """
        table = np.ones((self.field.shape[0], max(1, self.slots)))
        for world, parts in enumerate(rows):
            table[world, : self.slots] = [value for part in parts for value in part.values()]
        with np.errstate(over="ignore"):
            held = table.astype(np.float64 if self.field.dtype == ti.f64 else np.float32)
        for world, slot in np.argwhere(~np.isfinite(held)):
            slots = [
                (part.kind(), name)
                for part in rows[world]
                for name, _, n in part.parameters()
                for _ in range(n)
            ]
            must(False, ".".join(slots[slot]), "within the range of f32", float(table[world, slot]))
        self.field.from_numpy(held)

    def destroy(self) -> None:
        """Give the memory back."""
        self._tree.destroy()


def connect(bound: Sequence[Any]) -> None:
    """Let each bound effect know its index and choose what it wants to know of the others."""
    for index, effect in enumerate(bound):
        effect.__dict__.update(effect.connect(tuple(bound)), index=index)
