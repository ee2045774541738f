"""Device memory of a batch of worlds, and the parts of their scene bound to it; nothing is compiled yet."""

from __future__ import annotations

from typing import Any

from tisim.backend import runtime
from tisim.backend.memory import Tree, collected, require_memory
from tisim.engine.assembly import Assembly, needed_fields, needed_world_fields, picks_pairs
from tisim.engine.loading import check_inserted
from tisim.operators.base import adding
from tisim.pairs.half_list import ListSizes
from tisim.scene.scene import Scene
from tisim.state.bound import connected
from tisim.state.fields import resolve_fields
from tisim.state.parameter_table import ParameterTable
from tisim.state.state import State

COPIES = 3
"""Copies of every particle field in memory: one on the device, one for reading and one for going back."""


def parts(scene: Scene) -> list[Any]:
    """Return the parts of a scene that have parameters, in the order of the parameter table."""
    return [*scene.acting(), scene.domain, scene.stepper, scene.stepper.control]


class Allocation:
    """An allocation holds the state of a batch of worlds, their parameter table and the parts of a step.

    All worlds have the structure of the scene. An allocation must be made in the Taichi thread. It raises
    OutOfMemory if the memory does not suffice.
    """

    def __init__(self, scene: Scene, worlds: int, capacity: int) -> None:
        own = parts(scene)
        *acting, _, _, _ = own
        asked = (acting, scene.stepper)
        fields = resolve_fields(needed_fields(*asked), State.reserved())
        world_fields = needed_world_fields(*asked, (*State.reserved(), *(field.name for field in fields)))
        # Checked before compilation: a vector in place of a number would end the process.
        for effect in adding(scene.effects):
            check_inserted(fields, effect)
        real = 8 if runtime.current().precision == "f64" else 4
        # Checked before allocation: the compiler cannot refuse a request that is too large.
        require_memory(COPIES * sum(field.bytes(real, worlds, capacity) for field in fields))
        self._trees: list[Tree] = []
        self.s = State(worlds, capacity, fields, world_fields, picks_pairs(*asked))
        self.table = ParameterTable(own, worlds, runtime.current().real)
        bound = (self.table.bind(part) for part in own)
        *effects, self.domain, self.stepper, self.control = bound
        self.s.domain, self.effects = self.domain, connected(effects)
        self.assemble(ListSizes())

    def assemble(self, sizes: ListSizes) -> None:
        """Put a step together with lists of these sizes, and free the memory of the previous step.

        Raise OutOfMemory if there is not enough memory for the lists.
        """
        for tree in self._trees:
            tree.destroy()
        self.s.before_reading.clear()
        with collected() as self._trees:
            self.assembly = Assembly(self.s, self.effects, self.stepper, self.domain, self.control, sizes)
