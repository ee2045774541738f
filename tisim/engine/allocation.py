"""Device memory of a batch of worlds, and the parts of their scene bound to it; nothing is compiled yet."""

from __future__ import annotations

from typing import Any

from tisim.backend import runtime
from tisim.backend.memory import Tree, collected
from tisim.engine.assembly import Assembly, declared, needed_fields, picks_pairs
from tisim.errors import must
from tisim.neighbours.half_list import ListSizes
from tisim.scene.scene import Scene
from tisim.worlds.bound import connected
from tisim.worlds.fields import resolve_fields
from tisim.worlds.parameter_table import ParameterTable
from tisim.worlds.state import State


def parts(scene: Scene) -> list[Any]:
    """Return what a scene has parameters in, in the order of the table."""
    return [*scene.acting(), scene.domain, scene.stepper, scene.stepper.control]


class Allocation:
    """An allocation is the state of worlds of the structure of a scene, the table of their parameters, and
    the parts of a step.

    It must be made in the thread of Taichi. It raises InputError where the machine has not the memory.
    """

    def __init__(self, scene: Scene, worlds: int, capacity: int) -> None:
        # Fields and lists of a particle come to some hundred bytes; refused here, not in the compiler.
        needed, there = 300 * worlds * capacity, runtime.memory()
        rule = f"within the {there / 1e9:.0f} GB of this machine"
        must(needed <= there, f"memory for {worlds} x {capacity} particles", rule, f"{needed / 1e9:.0f} GB")
        asked = (scene.effects, scene.stepper)
        counters, quantities, flags = (
            declared(*asked, what) for what in ("counters", "world_quantities", "flags")
        )
        fields = resolve_fields(needed_fields(*asked))
        self.s = State(worlds, capacity, fields, counters, quantities, flags, picks_pairs(*asked))
        self.table = ParameterTable(parts(scene), worlds, runtime.current().real)
        *effects, self.domain, self.stepper, self.control = (self.table.bind(part) for part in parts(scene))
        self.s.domain, self.effects = self.domain, connected(effects)
        self._trees: list[Tree] = []
        self.assemble(ListSizes())

    def assemble(self, sizes: ListSizes) -> None:
        """Put a step together, with lists of these sizes; the memory of the one before is given back."""
        for tree in self._trees:
            tree.destroy()
        self.s.before_reading.clear()
        with collected() as self._trees:
            self.assembly = Assembly(self.s, self.effects, self.stepper, self.domain, self.control, sizes)
