"""Device memory of a batch of worlds, and the parts of their scene bound to it; nothing is compiled yet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tisim.backend import runtime
from tisim.engine.assembly import Assembly, declared, needed_fields
from tisim.errors import must
from tisim.scene.scene import Scene
from tisim.worlds.bound import connected
from tisim.worlds.fields import resolve_fields
from tisim.worlds.parameter_table import ParameterTable
from tisim.worlds.state import State


@dataclass(frozen=True)
class Allocation:
    """The state of a batch of worlds, the table of their parameters, and what a step consists of."""

    s: State
    table: ParameterTable
    assembly: Assembly


def parts(scene: Scene) -> list[Any]:
    """Return what a scene has parameters in, in the order of the table."""
    return [*scene.acting(), scene.domain, scene.stepper, scene.stepper.control]


def allocate(scene: Scene, worlds: int, capacity: int) -> Allocation:
    """Place the fields of worlds of the structure of a scene, of at most ``capacity`` particles each.

    To be called in the thread of Taichi. InputError where the machine has not the memory.
    """
    # Fields and lists of a particle come to some hundred bytes; refused here, not in the compiler.
    needed, there = 300 * worlds * capacity, runtime.memory()
    rule = f"within the {there / 1e9:.0f} GB of this machine"
    must(needed <= there, f"memory for {worlds} x {capacity} particles", rule, f"{needed / 1e9:.0f} GB")
    asked = (scene.effects, scene.stepper)
    names = (declared(*asked, what) for what in ("counters", "world_quantities", "flags"))
    s = State(worlds, capacity, resolve_fields(needed_fields(*asked)), *names)
    table = ParameterTable(parts(scene), worlds, runtime.current().real)
    *effects, domain, stepper, control = (table.bind(part) for part in parts(scene))
    return Allocation(s, table, Assembly(s, connected(effects), stepper, domain, control))
