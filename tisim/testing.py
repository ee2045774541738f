"""What a test of one's own law, operator or stepper asks of it, given a scene that has it.

    from tisim.testing import assert_contracts

    def test_contracts():
        assert_contracts(scene)

Each function raises AssertionError, and names what breaks the contract of tisim/effects/base.py or
tisim/steppers/base.py. The scene should have particles that meet; few will do, and some steps.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from tisim.backend.memory import Tree, collected
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects.base import DerivedQuantity, Effect, PairForce, Pairwise
from tisim.engine.allocation import Allocation, allocate, parts
from tisim.engine.loading import check_start, laid_out, world_columns
from tisim.engine.simulation import Simulation
from tisim.errors import must
from tisim.interactions.contact_history import memory_fields
from tisim.interactions.force_sum import FORCE, TORQUE, turning
from tisim.scene.scene import Scene
from tisim.worlds.bound import Bound
from tisim.worlds.fields import CORE
from tisim.worlds.state import State

NO_LISTS = 2**30
"""More particles than any world has: one with so many still looks at all pairs."""
WITHIN = 0.9
FARTHER = (1.001, 1.1, 2.0, 10.0, 100.0)
"""Distances of two centres at which a law is tried, over that of its reach."""
SHARES = np.array([1.0, 1 / 2, 1 / 3])
"""Radii that a law is tried with, one particle after another, over those of the scene."""


def assert_contracts(scene: Scene) -> None:
    """Assert that ``assert_fields``, ``assert_reach`` and ``assert_lists`` hold of a scene."""
    assert_fields(scene)
    assert_reach(scene)
    assert_lists(scene)


@in_taichi_thread
def assert_reach(scene: Scene) -> dict[str, float]:
    """Assert that each short-ranged law does nothing to two particles that are farther apart than its reach.

    It is tried with the radii of the scene, and with others, equal and unequal, along the line between each
    two particles; derived quantities are taken to be 1. Returns for each such law, by its name, the size of
    the most that it does nearer than that (N or N m, or of the quantity which it sets): where this is 0, the
    scene shows nothing of it.
    """
    most: dict[str, float] = {}
    start = scene.particles.arrays(scene.domain, scene.seed)
    shares = SHARES[np.arange(len(start["radius"])) % len(SHARES)]
    with _allocated(scene) as made:
        s = made.s
        check_start(s.fields, scene, start)
        made.table.write([parts(scene)])
        s.fill({f.name: laid_out(f, [start], 1, s.capacity) for f in s.fields})
        s.fill(world_columns([scene], [start], 1))
        s.fill({effect.data.quantity: 1.0 for effect in made.assembly.effects.of(DerivedQuantity)})
        for effect in made.assembly.effects.of(Pairwise):
            if effect.data.short_ranged:
                tried, label = _Distances(s, effect), effect.data.label
                for radius in (start["radius"], start["radius"] * shares):
                    s.write("radius", np.resize(radius, (1, s.capacity)))
                    sizes = tried.sizes()
                    most[label] = max(most.get(label, 0.0), float(sizes[..., 0].max()))
                    for i, j, k in np.argwhere(sizes[..., 1:] != 0)[:1]:
                        raise AssertionError(
                            f"{label} must be 0 between particles farther apart than its reach; received "
                            f"{sizes[i, j, k + 1]:g} on particle {i} by {j}, of radii {radius[i]:g} and "
                            f"{radius[j]:g} m, at {tried.factors[k + 1]:g} of that distance"
                        )
    return most


@contextmanager
def _allocated(scene: Scene) -> Iterator[Allocation]:
    """The memory of one world, and the bound parts of its scene, for a while."""
    with collected() as trees:
        made = allocate(scene, 1, scene.capacity())
        try:
            yield made
        finally:
            for tree in trees:
                tree.destroy()


def assert_lists(scene: Scene, simulation: Simulation | None = None) -> None:
    """Assert that a scene comes to the same end, to rounding, with cell lists and with a look at all pairs.

    It does not where a law has too short a ``reach``, or where a stepper or an operator moves particles and
    does not say how far. The scene must have steps that do not depend on which pairs are looked at.

    simulation : one of two worlds that has been compiled for the structure of the scene.
    """
    control = scene.stepper.control
    must(not control.watches_pairs, "step control", "one that does not look at pairs", control.kind())
    made = simulation or Simulation(scene, worlds=2)
    made.load([scene, scene])
    made.s.write("listed_above", np.array([0, NO_LISTS]))
    made.begin()
    _assert_equal(made, "at the start")
    made.run()
    for result in made.results():
        assert result.status.ok, result.status.reason
    _assert_equal(made, "at the end")
    if simulation is None:
        made.close()


def _assert_equal(simulation: Simulation, when: str) -> None:
    """Assert that two worlds are the same, to rounding that steps have had time to magnify."""
    listed, everyone = simulation.results()
    a, b = len(listed.state["mass"]), len(everyone.state["mass"])
    assert a == b, f"{when} there must be {b} particles as with a look at all pairs; received {a} with lists"
    for name, values in everyone.state.items():
        others, start = listed.state[name], everyone.start.get(name)
        precision = np.finfo(values.dtype).eps if values.dtype.kind == "f" else 0.0
        moved = values - start if start is not None and start.shape == values.shape else values
        allowed = np.sqrt(precision) * np.abs(moved).max(initial=0.0)
        allowed += 100 * precision * np.abs(values).max(initial=0.0)
        off = np.abs(values - others).max(initial=0.0)
        assert off <= allowed, (
            f"{name} {when} must be with lists what it is with a look at all pairs, within {allowed:g}; "
            f"received one that is off by {off:g}"
        )


@in_taichi_thread
def assert_fields(scene: Scene) -> None:
    """Assert that every effect of a scene declares the particle fields that it reads or writes.

    A field that another effect happens to declare would be there in this scene, and missing in the next.
    Fields of the effects that it requires, or takes hold of in ``connect``, are there whenever it is, and so
    are ``force`` and ``torque`` for one that asks first whether there are any.
    """
    with _allocated(scene) as made:
        for effect in made.assembly.effects:
            view = _Declared(made.s, effect)
            try:
                _Hooks(view, effect).compile(0)
            except Exception as error:
                if not view.refused:
                    raise
                raise AssertionError(
                    f"{effect.data.label}.fields must name {view.refused[-1]!r}, which it reads or writes; "
                    f"received {', '.join(sorted(view.declared)) or 'none'}"
                ) from error


def _known(effect: Bound[Effect]) -> Iterator[Bound[Effect]]:
    """An effect, and all that it or one of these has taken hold of."""
    waiting, seen = [effect], set()
    while waiting:
        one = waiting.pop()
        if id(one) in seen or not isinstance(one, Bound):
            continue
        seen.add(id(one))
        yield one
        for value in vars(one).values():
            waiting += [value] if isinstance(value, Bound) else value if isinstance(value, tuple) else []


@ti.data_oriented
class _Declared:
    """A state as one effect may see it: with the particle fields that are there whenever the effect is."""

    def __init__(self, s: State, effect: Bound[Effect]) -> None:
        self.s = s
        self.refused: list[str] = []
        found = [one.data for one in _known(effect) if isinstance(one.data, Effect)]
        fields = [field for data in found for field in data.required_fields()]
        fields += [field for data in found if isinstance(data, PairForce) for field in memory_fields(data)]
        self.declared = {field if isinstance(field, str) else field.name for field in fields}
        if turning([effect.data]):
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
    """All that an effect does to particles, compiled and never run."""

    def __init__(self, view: _Declared, effect: Bound[Effect]) -> None:
        self.s = view
        self.single = self.offered(effect, "force", "torque", "velocity_jacobian")
        self.reach = self.offered(effect, "reach")
        self.pair = self.offered(effect, "pair_force", "pair_torque", "influence")
        self.touching, self.remember = self.offered(effect, "touching"), self.offered(effect, "remember")
        self.response = self.offered(effect, "response")
        self.event = self.offered(effect, "contact", "resolve")
        self.particle, self.world = self.offered(effect, "particle"), self.offered(effect, "world")

    @staticmethod
    def offered(effect: Bound[Effect], *names: str) -> tuple[Callable[..., Any], ...]:
        data = effect.data
        return tuple(getattr(effect, name) for name in names if hasattr(data, name) and data.offers(name))

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
        for hook in ti.static(self.touching):
            hook(s, w, i, j, apart, distance)
        for hook in ti.static(self.remember):
            hook(s, w, i, j, apart, distance, apart, dt)
        for hook in ti.static(self.response):
            hook(s, w, i, apart, t)
        for hook in ti.static(self.event):
            hook(s, w, i, j, apart)
        for hook in ti.static(self.particle):
            hook(s, w, i, t, dt)
        for hook in ti.static(self.world):
            hook(s, w)


@ti.data_oriented
class _Distances:
    """How much a short-ranged law would do to each pair of the first world, at some distances."""

    def __init__(self, s: State, effect: Bound[Any]) -> None:
        names = ("pair_force", "pair_torque", "influence")
        self.s, self.effect, self.laws = s, effect, _Hooks.offered(effect, *names)
        # Where the distance is that of the reach, a law may find it just within by rounding.
        at = 1.0 + 1e3 * float(np.finfo(np.float64 if s.real == ti.f64 else np.float32).eps)
        self.factors = (WITHIN, at, *FARTHER)
        self.number = len(self.factors)
        # In memory: a loop over constants would compile the law for each of them.
        self.factor, self.size, builder = ti.field(ti.f64), ti.field(s.real), ti.FieldsBuilder()
        builder.dense(ti.i, len(self.factors)).place(self.factor)
        builder.dense(ti.ijk, (s.capacity, s.capacity, len(self.factors))).place(self.size)
        Tree(builder)
        self.factor.from_numpy(np.array(self.factors))

    def sizes(self) -> np.ndarray:
        """Sizes of what a particle does to another, indexed by the other, itself and the distance."""
        self.measure()
        return self.size.to_numpy()

    @ti.kernel
    def measure(self):
        for i, j in ti.ndrange(self.s.count[0], self.s.count[0]):
            if i != j:
                self.pair(i, j)

    @ti.func
    def pair(self, i, j):
        s = self.s
        a, b = s.radius[0, i], s.radius[0, j]
        owner = ti.select(a > b or (a == b and i < j), i, j)
        limit = a + b + ti.max(self.effect.reach(s, 0, owner), 0.0)
        apart = s.position[0, j] - s.position[0, i]
        for k in range(self.number):
            distance = limit * ti.cast(self.factor[k], s.real)
            total = 0.0 * a
            for law in ti.static(self.laws):
                total += law(s, 0, i, j, distance / apart.norm() * apart, distance, s.time[0]).norm()
            self.size[i, j, k] = total
