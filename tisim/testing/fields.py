"""Test that effects declare the particle fields that they read or write."""

import itertools
from typing import Any

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects.base import Effect, Force, PairEvent, PairForce
from tisim.forces.force_sum import turning
from tisim.forces.loads import FORCE, TORQUE
from tisim.pairs.contact_memory import memory_fields
from tisim.scene.scene import Scene
from tisim.state.bound import Bound, Peers
from tisim.state.fields import CORE
from tisim.state.state import State
from tisim.testing.uncompiled import allocated, offered


@in_taichi_thread
def assert_fields(scene: Scene) -> None:
    """Assert that every effect of a scene declares the particle fields that it reads or writes.

    An undeclared field may exist in this scene because another effect declares it, and be missing in another
    scene. Fields of effects that it requires, or refers to in ``connect``, always exist. It may read
    ``force`` and ``torque`` if it first checks that they exist.
    """
    with allocated(scene) as allocation:
        effects = allocation.assembly.effects
        for effect in effects:
            view = _DeclaredState(allocation.s, _related(effect, effects))
            try:
                _Hooks(view, effect).compile(0)
            except Exception as error:
                if not view.refused:
                    raise
                raise AssertionError(
                    f"{effect.data.label}.fields must name {view.refused[-1]!r}, which it reads or writes; "
                    f"received {', '.join(sorted(view.declared)) or 'none'}"
                ) from error


def _related(effect: Bound[Effect], peers: Peers) -> list[Bound[Effect]]:
    """Return an effect, and all effects that it requires or refers to, directly or indirectly."""
    related = [effect]
    # The list grows during the loop.
    for member in related:
        attributes = [value if isinstance(value, tuple) else (value,) for value in vars(member).values()]
        required = peers.of(*member.data.requires)
        ids = {id(value) for value in (*required, *itertools.chain.from_iterable(attributes))}
        related += [other for other in peers if id(other) in ids and other not in related]
    return related


@ti.data_oriented
class _DeclaredState:
    """A view of the state with only the particle fields that an effect and its related effects declare."""

    def __init__(self, s: State, effects: list[Bound[Effect]]) -> None:
        self.s = s
        self.refused: list[str] = []
        found = [effect.data for effect in effects]
        fields = [field for data in found for field in data.required_fields()]
        fields += [field for data in found if isinstance(data, PairForce) for field in memory_fields(data)]
        for force in (data for data in found if isinstance(data, Force)):
            fields += force.memory_fields(found)
        self.declared = {field if isinstance(field, str) else field.name for field in fields}
        if turning(found):
            self.declared.add("spin")
        self.hidden = (
            {field.name for field in s.fields}
            - {field.name for field in (*CORE, FORCE, TORQUE)}
            - self.declared
        )

    def __getattr__(self, name: str) -> Any:
        if name in self.hidden:
            self.refused.append(name)
            raise AttributeError(name)
        return getattr(self.s, name)


@ti.data_oriented
class _Hooks:
    """Kernel that compiles, and never runs, all hooks of an effect that read or write particles."""

    def __init__(self, view: _DeclaredState, effect: Bound[Effect]) -> None:
        self.s = view
        self.single = offered(effect, "force", "torque", "velocity_jacobian")
        self.reach = offered(effect, "reach")
        self.pair = offered(effect, "pair_force", "pair_force_by_inverse", "pair_torque", "influence")
        self.load, self.interaction = offered(effect, "load"), offered(effect, "interaction")
        self.memory = max(1, getattr(effect.data, "memory", 0))
        self.response = offered(effect, "response")
        event = isinstance(effect.data, PairEvent)
        self.event = offered(effect, "contact", "resolve") if event else ()
        self.particle, self.world = offered(effect, "particle"), offered(effect, "world")

    @ti.kernel
    def compile(self, worlds: ti.i32):
        for w in range(worlds):
            self.call(w, 0, 1)

    @ti.func
    def call(self, w, i, j):
        s = self.s
        t, dt = s.time[w], ti.cast(s.dt[w], s.real)
        apart, distance = s.position[w, j] - s.position[w, i], s.radius[w, i]
        for hook in ti.static(self.single):
            hook(s, w, i, t)
        for hook in ti.static(self.reach):
            hook(s, w, i)
        for hook in ti.static(self.pair):
            hook(s, w, i, j, apart, distance, t)
        past = ti.Vector.zero(s.real, self.memory)
        for hook in ti.static(self.interaction):
            hook(s, w, i, j, apart, distance, past, dt, t)
        for hook in ti.static(self.load):
            hook(s, w, i, t, dt, True)
        for hook in ti.static(self.response):
            hook(s, w, i, apart, t)
        for hook in ti.static(self.event):
            hook(s, w, i, j, apart)
        for hook in ti.static(self.particle):
            hook(s, w, i, t, dt)
        for hook in ti.static(self.world):
            hook(s, w)
