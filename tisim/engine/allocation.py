"""Device memory of a batch of worlds, and the parts of their scene bound to it; nothing is compiled yet."""

from __future__ import annotations

from typing import Any

from tisim.backend import runtime
from tisim.backend.memory import Tree, collected, require_memory
from tisim.engine.assembly import Assembly, declared, needed_fields, picks_pairs
from tisim.engine.loading import check_newcomers
from tisim.pairs.half_list import ListSizes
from tisim.scene.scene import Scene
from tisim.state.bound import connected
from tisim.state.fields import resolve_fields
from tisim.state.parameter_table import ParameterTable
from tisim.state.state import State

COPIES = 3
"""The fields of particles are in memory so many times: on the device, for what is asked for, and to go back
to."""


def parts(scene: Scene) -> list[Any]:
    """Return what a scene has parameters in, in the order of the table."""
    return [*scene.acting(), scene.domain, scene.stepper, scene.stepper.control]


class Allocation:
    """An allocation is the state of worlds of the structure of a scene, the table of their parameters, and
    the parts of a step.

    It must be made in the thread of Taichi. It raises NoRoom where there is none for it.
    """

    def __init__(self, scene: Scene, worlds: int, capacity: int) -> None:
        asked = (scene.acting(), scene.stepper)
        counters, quantities, clocks, flags, totals = (
            declared(*asked, what) for what in ("counters", "world_quantities", "clocks", "flags", "totals")
        )
        fields = resolve_fields(needed_fields(*asked))
        # Before anything is compiled: a vector for a number would end the process.
        for effect in scene.effects:
            check_newcomers(fields, effect)
        real = 8 if runtime.current().precision == "f64" else 4
        # Before anything is placed: the compiler cannot refuse what is too much for it.
        require_memory(COPIES * sum(field.bytes(real, worlds, capacity) for field in fields))
        self._trees: list[Tree] = []
        kept = (*quantities, *clocks)
        self.s = State(worlds, capacity, fields, counters, kept, flags, picks_pairs(*asked), totals)
        self.table = ParameterTable(parts(scene), worlds, runtime.current().real)
        bound = (self.table.bind(part) for part in parts(scene))
        *effects, self.domain, self.stepper, self.control = bound
        self.s.domain, self.effects = self.domain, connected(effects)
        self.assemble(ListSizes())

    def assemble(self, sizes: ListSizes) -> None:
        """Put a step together, with lists of these sizes; the memory of the one before is given back.

        Raise NoRoom where there is none for them.
        """
        for tree in self._trees:
            tree.destroy()
        self.s.before_reading.clear()
        with collected() as self._trees:
            self.assembly = Assembly(self.s, self.effects, self.stepper, self.domain, self.control, sizes)
