"""Test that pair forces write nothing, and that all ways of evaluating them agree, also for moving images."""

from typing import Any

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects.base import DerivedQuantity, PairForce
from tisim.scene.scene import Scene
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.testing.image_velocities import ImageVelocities, assert_same
from tisim.testing.uncompiled import started

TOUCHING = 0.9
"""Second distance at which a law is evaluated, relative to the contact distance; the first is that in the
scene."""
COMPARED_AT = (0.5, 1.0, 2.0)
"""Distances, relative to the one in the scene, at which the force from the inverse distance is compared."""


@in_taichi_thread
def assert_pair_forces(scene: Scene) -> None:
    """Assert that each pair force of a scene satisfies its contract.

    It must write nothing. If it is ``homogeneous``, it must take velocities only from
    ``s.relative_velocity``. If it defines ``pair_force_by_inverse``, this must agree with ``pair_force`` to
    rounding, and be 0 for an inverse distance of 0.

    Several pairs are computed in parallel, and some twice, so that a write by a law would be counted twice or
    lost. Images in a sheared box have other velocities than their particles. A law is evaluated for each two
    particles at their initial positions, with velocities of the magnitude in the start; derived quantities
    are set to 1.
    """
    with started(scene) as (allocation, start):
        s, n = allocation.s, len(start["radius"])
        s.fill({effect.data.quantity: 1.0 for effect in allocation.assembly.effects.of(DerivedQuantity)})
        images, speed = ImageVelocities(s), float(np.abs(start["velocity"]).max())
        s.domain = images
        for effect in allocation.assembly.effects.of(PairForce):
            call, found = _Calls(s, effect), []
            for moving in (False, True) if effect.data.homogeneous else (False,):
                images.set(s, speed, moving)
                found.append(_written_nothing(s, call, scene.duration))
            for here, there in zip(found[0], found[-1], strict=True):
                assert_same(effect.data.label, here, there)
            if effect.data.offers_inverse():
                _assert_same_by_inverse(effect, _ByInverse(s, effect).forces()[:n, :n])


def _written_nothing(s: State, call: "_Calls", duration: float) -> list[np.ndarray]:
    """Return the results of a law for pairs without and with a contact history, after checking that it writes
    nothing."""
    before, label = s.image(), call.effect.data.label
    found = [call.results(remembered, duration) for remembered in (0.0, 1.0)]
    for name, values in s.image().items():
        same = np.array_equal(values, before[name], equal_nan=values.dtype.kind == "f")
        assert same, f"{label} must write nothing between two particles; received a changed {name}"
    return found


def _assert_same_by_inverse(effect: Bound[Any], forces: np.ndarray) -> None:
    """forces : for each two particles and each factor, from the distance, from its inverse, and from an
    inverse of 0."""
    by_distance, by_inverse, by_none = (forces[..., k, :] for k in range(3))
    # A force that passes through 0 at some distance is compared relative to its size at other distances.
    size = np.abs(by_distance).max(axis=(2, 3), keepdims=True)
    wrong = ~(np.abs(by_inverse - by_distance) <= np.sqrt(np.finfo(forces.dtype).eps) * size)
    for i, j, k, c in np.argwhere(wrong)[:1]:
        raise AssertionError(
            f"{effect.data.label}.pair_force_by_inverse must be pair_force, {by_distance[i, j, k, c]:g} N on "
            f"particle {i} by {j} along axis {c}; received {by_inverse[i, j, k, c]:g}"
        )
    for i, j, k, c in np.argwhere(by_none != 0)[:1]:
        raise AssertionError(
            f"{effect.data.label}.pair_force_by_inverse must be 0 if the inverse is 0; "
            f"received {by_none[i, j, k, c]:g} N on particle {i} by {j} along axis {c}"
        )


@ti.data_oriented
class _Calls:
    """Kernel that evaluates a law for each two particles of the first world, at two distances."""

    def __init__(self, s: State, effect: Bound[Any]) -> None:
        self.s, self.effect, self.found, builder = s, effect, ti.field(s.real), Builder()
        self.memory = max(1, effect.data.memory)
        builder.dense(ti.ijkl, (s.capacity, s.capacity, 2, 9)).place(self.found)
        Tree(builder)

    def results(self, remembered: float, duration: float) -> np.ndarray:
        """Return force and both torques by index of the particle, of the other one and of the distance, (...,
        9)."""
        self.all(remembered, duration)
        found: np.ndarray = self.found.to_numpy()
        return found

    @ti.kernel
    def all(self, remembered: ti.f64, duration: ti.f64):
        for i, j in ti.ndrange(self.s.count[0], self.s.count[0]):
            if i != j:
                self.pair(i, j, remembered, duration)

    @ti.func
    def pair(self, i, j, remembered, duration):
        s = self.s
        apart = s.position[0, j] - s.position[0, i]
        length, touching = apart.norm(), ti.cast(TOUCHING, s.real) * (s.radius[0, i] + s.radius[0, j])
        past = ti.Vector.zero(s.real, self.memory) + ti.cast(remembered, s.real)
        # A loop is used so that the law is compiled once.
        for k in range(2):
            distance = ti.select(k == 0, length, touching)
            force, turn, back, _ = self.effect.interaction(
                s, 0, i, j, distance / length * apart, distance, past, ti.cast(duration, s.real), s.time[0]
            )
            for c in ti.static(range(3)):
                self.found[i, j, k, c] = force[c]
                self.found[i, j, k, 3 + c] = turn[c]
                self.found[i, j, k, 6 + c] = back[c]


@ti.data_oriented
class _ByInverse:
    """Kernel that evaluates a law for each two particles of the first world, from distances and from inverse
    distances."""

    def __init__(self, s: State, effect: Bound[Any]) -> None:
        self.s, self.effect, self.number = s, effect, len(COMPARED_AT)
        self.factor, self.force, builder = ti.field(ti.f64), ti.field(s.real), Builder()
        builder.dense(ti.i, self.number).place(self.factor)
        shape = (s.capacity, s.capacity, self.number, 9)
        builder.dense(ti.ijkl, shape).place(self.force)
        Tree(builder)
        self.factor.from_numpy(np.array(COMPARED_AT))

    def forces(self) -> np.ndarray:
        """Return the forces by index of the particle, of the other one, of the factor and of the way of
        evaluation, (..., 3)."""
        self.measure()
        found = self.force.to_numpy()
        return found.reshape(*found.shape[:3], 3, 3)

    @ti.kernel
    def measure(self):
        for i, j in ti.ndrange(self.s.count[0], self.s.count[0]):
            if i != j:
                self.pair(i, j)

    @ti.func
    def pair(self, i, j):
        s, t = self.s, self.s.time[0]
        apart = s.position[0, j] - s.position[0, i]
        for k in range(self.number):
            d = ti.cast(self.factor[k], s.real) * apart
            distance = d.norm()
            one = self.effect.pair_force(s, 0, i, j, d, distance, t)
            other = self.effect.pair_force_by_inverse(s, 0, i, j, d, 1.0 / distance, t)
            none = self.effect.pair_force_by_inverse(s, 0, i, j, d, 0.0 * distance, t)
            for c in ti.static(range(3)):
                self.force[i, j, k, c] = one[c]
                self.force[i, j, k, 3 + c] = other[c]
                self.force[i, j, k, 6 + c] = none[c]
