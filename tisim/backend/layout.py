"""The layout of fields in device memory.

For Vulkan, Taichi 1.7.4 arranges the parts of a cell without gaps, in the order of their sizes. An 8-byte
number that does not begin at a multiple of 8 then silently overwrites its neighbour. Unused padding is
therefore inserted.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

from tisim.backend import runtime
from tisim.backend.taichi import ti

WORD = 8
"""Bytes of the widest number."""
WIDE_TYPES = ("f64", "i64", "u64")
"""Types with 8 bytes; all others in use have 4."""


class Level:
    """A level of memory has cells, each of which holds all fields and levels placed in it."""

    def __init__(self, axes: Any = None, shape: Any = ()) -> None:
        self.axes, self.shape = axes, shape
        self.parts: list[Any] = []
        self.cells = math.prod(shape) if isinstance(shape, tuple) else shape

    def dense(self, axes: Any, shape: Any) -> Level:
        """Return a new level with this shape in each cell of this one."""
        level = Level(axes, shape)
        self.parts.append(level)
        return level

    def place(self, *columns: Any) -> None:
        """Put fields into each cell, one after the other."""
        self.parts += columns

    def lay(self, node: Any) -> None:
        """Create this level in a node of Taichi."""
        for part in self.parts:
            if isinstance(part, Level):
                part.lay(node.dense(part.axes, part.shape))
            else:
                node.place(part)

    def sizes(self, cells: int = 1) -> Iterator[tuple[int, int]]:
        """Yield the number of entries of each field, and the bytes of an entry.

        cells : number of cells that hold this level.
        """
        for part in self.parts:
            if isinstance(part, Level):
                yield from part.sizes(cells * self.cells)
            else:
                for one in part.vars:
                    yield cells * self.cells, _bytes(one)

    def fill_up(self) -> int:
        """Add padding so that 8-byte numbers begin at multiples of 8; return the bytes of all cells."""
        # Taichi places each component of a vector as a separate part.
        sizes: list[int] = []
        for part in self.parts:
            sizes += [part.fill_up()] if isinstance(part, Level) else map(_bytes, part.vars)
        if self._is_wide():
            # A part whose size is no multiple of 8 is paired with another one of its size.
            for size, number in Counter(size for size in sizes if size % WORD).items():
                if number % 2:
                    self.dense(ti.l, size // 4).place(ti.field(ti.i32))
                    sizes.append(size)
        return sum(sizes) * self.cells

    def _is_wide(self) -> bool:
        """Return whether any number in this level has 8 bytes."""
        return any(size == WORD for _, size in self.sizes())


class Builder(Level):
    """A builder allocates device memory for all fields placed in it."""

    def __init__(self) -> None:
        super().__init__(shape=1)

    def finalize(self) -> Any:
        """Return the Taichi tree with all fields."""
        if runtime.current().device == "vulkan":
            self.fill_up()
        builder = ti.FieldsBuilder()
        self.lay(builder)
        return builder.finalize()

    def abandon(self) -> None:
        """Place the fields without allocating memory.

        A field that is never placed, or is in an unfinished builder, would break every later kernel.
        """
        builder = ti.FieldsBuilder()
        self.lay(builder)
        ti.lang.impl.get_runtime().finalize_fields_builder(builder)


def _bytes(one: Any) -> int:
    """Return the bytes of a number of a field, or of one of its components, before it is placed."""
    return WORD if one.ptr.get_dt().to_string() in WIDE_TYPES else 4
