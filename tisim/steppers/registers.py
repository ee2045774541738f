"""A particle's state in local variables of a kernel, which the compiler keeps in registers."""

from copy import copy
from typing import Any, TypeVar

from tisim.backend.taichi import ti
from tisim.state.state import State

Part = TypeVar("Part")


class Local:
    """Local stands for a particle field where a single particle is looked at: its value, whatever the
    index."""

    value: Any = None

    def assign(self, value: Any) -> None:
        self.value = value

    def __getitem__(self, _index: Any) -> Any:
        return self.value


@ti.data_oriented
class Registers:
    """Registers hold a state that is read and written as any other, but the named fields of one particle are
    local variables.

    loaded : fields of three components or one that are taken from memory, and put back. own : vectors that
    exist here only.
    """

    def __init__(self, s: State, loaded: tuple[str, ...], own: tuple[str, ...]) -> None:
        self.state = copy(s)
        self.loaded = tuple((getattr(s, name), Local()) for name in loaded)
        self.own = tuple(Local() for _ in own)
        for name, local in zip((*loaded, *own), (*(x for _, x in self.loaded), *self.own), strict=True):
            setattr(self.state, name, local)

    def with_registers(self, part: Part) -> Part:
        """Return a copy of a part of a step that works on this state."""
        copied: Any = copy(part)
        copied.s = self.state
        return copied

    @ti.func
    def load(self, w, i):
        """Take a particle out of memory, into variables of the block that calls this."""
        for field, local in ti.static(self.loaded):
            value = field[w, i]
            ti.static(local.assign(value))
        for local in ti.static(self.own):
            value = ti.Vector.zero(self.state.real, 3)
            ti.static(local.assign(value))

    def assign(self, *values: Any) -> None:
        """Take these values for what ``load`` would take from memory."""
        for (_, local), value in zip(self.loaded, values, strict=True):
            local.assign(value)

    @ti.func
    def store(self, w, i):
        """Put the particle back into memory."""
        for field, local in ti.static(self.loaded):
            field[w, i] = local[w, i]
