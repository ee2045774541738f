"""A particle's state in local variables of a kernel, which the compiler keeps in registers."""

from copy import copy
from typing import Any, TypeVar

from tisim.backend.taichi import ti
from tisim.state.state import State

Part = TypeVar("Part")


class Local:
    """A single particle's value in place of a particle field, for any index."""

    value: Any = None

    def assign(self, value: Any) -> None:
        self.value = value

    def __getitem__(self, _index: Any) -> Any:
        return self.value


@ti.data_oriented
class Registers:
    """A state that is read and written like any other, except that the named fields of one particle are local
    variables.

    loaded : fields of three components or one that are loaded from memory and stored back. own : vectors that
    exist only here.
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
        """Load a particle from memory into variables of the calling block."""
        for field, local in ti.static(self.loaded):
            value = field[w, i]
            ti.static(local.assign(value))
        for local in ti.static(self.own):
            value = ti.Vector.zero(self.state.real, 3)
            ti.static(local.assign(value))

    def assign(self, *values: Any) -> None:
        """Use these values instead of those that ``load`` would read from memory."""
        for (_, local), value in zip(self.loaded, values, strict=True):
            local.assign(value)

    @ti.func
    def store(self, w, i):
        """Store the particle back into memory."""
        for field, local in ti.static(self.loaded):
            field[w, i] = local[w, i]
