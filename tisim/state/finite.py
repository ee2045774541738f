"""Whether every quantity of the live particles is finite, asked on the device."""

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.ieee import finite
from tisim.state.state import State


@ti.data_oriented
class FiniteCheck:
    """This check asks for all worlds of a state at once whether all is finite; a copy of all quantities would
    take much longer."""

    def __init__(self, s: State) -> None:
        self.s, self.not_finite = s, ti.field(ti.i32)
        builder = Builder()
        builder.dense(ti.i, s.worlds).place(self.not_finite)
        self.tree = Tree(builder)
        fields = [field for field in s.reported if not field.integer]
        self.scalars = tuple(getattr(s, f.name) for f in fields if f.components == 1 and not f.slots)
        self.vectors = tuple(getattr(s, f.name) for f in fields if f.components == 3)
        self.slotted = tuple((getattr(s, f.name), f.slots) for f in fields if f.slots)

    @in_taichi_thread
    def finite_worlds(self) -> np.ndarray:
        """Return whether all is finite, by world."""
        self._check_all()
        finite: np.ndarray = self.not_finite.to_numpy() == 0
        return finite

    @ti.kernel
    def _check_all(self):
        for w in range(self.s.worlds):
            self.not_finite[w] = 0
        for w, i in ti.ndrange(self.s.worlds, self.s.capacity):
            if i < self.s.count[w]:
                broken = 0
                for column in ti.static(self.scalars):
                    broken += ti.cast(not finite(column[w, i]), ti.i32)
                for column in ti.static(self.vectors):
                    for k in ti.static(range(3)):
                        broken += ti.cast(not finite(column[w, i][k]), ti.i32)
                for column in ti.static(self.slotted):
                    for k in range(column[1]):
                        broken += ti.cast(not finite(column[0][w, i, k]), ti.i32)
                if broken > 0:
                    self.not_finite[w] = 1
