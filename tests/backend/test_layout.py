"""Layout of fields on a device that leaves no gaps: each 8-byte number begins at a multiple of 8."""

import pytest

from tisim.backend.layout import WORD, Builder, Level
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread


def size(part):
    """Bytes of a part, for all cells of a level."""
    if isinstance(part, Level):
        return part.cells * sum(map(size, parts(part)))
    return WORD if part.ptr.get_dt().to_string() in ("f64", "i64") else 4


def parts(level):
    """The parts that Taichi lays out in a cell: levels, and each component of a field separately."""
    for part in level.parts:
        yield from [part] if isinstance(part, Level) else part.vars


def wide_places(level, begin=0):
    """Offsets of 8-byte numbers; Taichi lays parts out in order of size."""
    for cell in range(level.cells):
        at = begin + cell * size(level) // level.cells
        for part in sorted(parts(level), key=size):
            if isinstance(part, Level):
                yield from wide_places(part, at)
            elif size(part) == WORD:
                yield at
            at += size(part)


def mixed():
    """A builder with fields of both widths, side by side and in one cell, in odd numbers."""
    builder = Builder()
    for cells, kind in ((3, ti.i32), (2, ti.f64), (1, ti.i32), (5, ti.i32), (1, ti.i64)):
        builder.dense(ti.i, cells).place(ti.field(kind))
    together = builder.dense(ti.i, 3)
    for column in (ti.field(ti.i32), ti.Vector.field(3, ti.f64), ti.Vector.field(3, ti.i32)):
        together.place(column)
    together.dense(ti.j, 3).place(ti.field(ti.i32))
    together.dense(ti.j, 3).place(ti.field(ti.f64))
    return builder


def narrow_vector():
    """A builder with a vector of 4-byte numbers and an 8-byte one, whose components are laid out
    one by one."""
    builder = Builder()
    together = builder.dense(ti.i, 2)
    together.place(ti.Vector.field(3, ti.f32), ti.field(ti.f64))
    return builder


@pytest.mark.parametrize("made", [mixed, narrow_vector])
@pytest.mark.skipif(ti.__name__ != "taichi", reason="what Vulkan needs is asked of Taichi")
@in_taichi_thread
def test_numbers_of_eight_bytes_begin_at_multiples_of_eight(made):
    builder = made()
    assert any(place % WORD for place in wide_places(builder))
    assert builder.fill_up() == size(builder)
    assert not any(place % WORD for place in wide_places(builder))
    # Taichi must have materialised the fields.
    Tree(builder).destroy()
