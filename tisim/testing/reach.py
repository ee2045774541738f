"""Test that short-ranged laws are 0 beyond their interaction range."""

from typing import Any

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects.base import DerivedQuantity, PairForce, Pairwise
from tisim.scene.scene import Scene
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.testing.uncompiled import started

WITHIN = 0.9
FARTHER = (1.001, 1.1, 2.0, 10.0, 100.0)
"""Distances between centres at which a law is evaluated, relative to its interaction range."""
RADIUS_FACTORS = np.array([1.0, 1 / 2, 1 / 3])
"""A law is also evaluated with the radii of the scene times these factors, used in turn for the particles."""


@in_taichi_thread
def assert_reach(scene: Scene) -> dict[str, float]:
    """Assert that each short-ranged law is 0 for two particles farther apart than its interaction range.

    It is evaluated with the radii of the scene, and with other radii, equal and unequal, along the line
    between each two particles; derived quantities are set to 1. The return value has, for each such law by
    name, the largest value within its range (N or N m, or in the unit of the quantity that it sets). If this
    is 0, the scene does not test the law.
    """
    largest: dict[str, float] = {}
    with started(scene) as (allocation, start):
        s, factors = allocation.s, np.resize(RADIUS_FACTORS, len(start["radius"]))
        s.fill({effect.data.quantity: 1.0 for effect in allocation.assembly.effects.of(DerivedQuantity)})
        for effect in allocation.assembly.effects.of(Pairwise):
            if effect.data.short_ranged:
                samples, label = _Distances(s, effect), effect.data.label
                for radius in (start["radius"], start["radius"] * factors):
                    s.write("radius", np.resize(radius, (1, s.capacity)))
                    sizes = samples.sizes()
                    largest[label] = max(largest.get(label, 0.0), float(sizes[..., 0].max()))
                    for i, j, k in np.argwhere(sizes[..., 1:] != 0)[:1]:
                        raise AssertionError(
                            f"{label} must be 0 between particles farther apart than its reach; received "
                            f"{sizes[i, j, k + 1]:g} on particle {i} by {j}, of radii {radius[i]:g} and "
                            f"{radius[j]:g} m, at {samples.factors[k + 1]:.3g} of that distance"
                        )
    return largest


@ti.data_oriented
class _Distances:
    """Kernel that evaluates a short-ranged law for each pair of the first world, at some distances."""

    def __init__(self, s: State, effect: Bound[Any]) -> None:
        self.s, self.effect, self.force = s, effect, isinstance(effect.data, PairForce)
        self.memory = max(1, getattr(effect.data, "memory", 0))
        # At exactly the interaction range, rounding may put the pair just inside it.
        at = 1.0 + 1e3 * float(np.finfo(np.float64 if s.real == ti.f64 else np.float32).eps)
        self.factors = (WITHIN, at, *FARTHER)
        self.number = len(self.factors)
        # The factors are in a field, because a loop over constants would compile the law for each of them.
        self.factor, self.size, builder = ti.field(ti.f64), ti.field(s.real), Builder()
        builder.dense(ti.i, self.number).place(self.factor)
        builder.dense(ti.ijk, (s.capacity, s.capacity, self.number)).place(self.size)
        Tree(builder)
        self.factor.from_numpy(np.array(self.factors))

    def sizes(self) -> np.ndarray:
        """Return the sizes of the law by index of the particle, of the other one and of the distance."""
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
            self.size[i, j, k] = self.effect_size(i, j, distance / apart.norm() * apart, distance)

    @ti.func
    def effect_size(self, i, j, separation, distance):
        """Return the largest component of the interaction of i and j; not a norm, because in f32 the square
        of a small force underflows."""
        s, total = self.s, 0.0 * distance
        if ti.static(self.force):
            past = ti.Vector.zero(s.real, self.memory)
            force, turn, back, _ = self.effect.interaction(
                s, 0, i, j, separation, distance, past, 0.0 * distance, s.time[0]
            )
            total = ti.abs(force).max() + ti.abs(turn).max() + ti.abs(back).max()
        else:
            total = ti.abs(self.effect.influence(s, 0, i, j, separation, distance, s.time[0])).max()
        return total
