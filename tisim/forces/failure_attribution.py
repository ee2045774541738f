"""Identify the force that stopped a world, after the failure, by a kernel that is compiled only then.

Inside the kernels of a step this would repeat the laws of all forces and double their compile time.
"""

import numpy as np

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.forces.force_sum import SumForces
from tisim.numerics.ieee import finite
from tisim.state.status import ASKED

HALVINGS = 40
"""Number of halvings in the search for the longest step with a finite force."""


@ti.data_oriented
class FailureAttribution:
    """A failure attribution names, for each world stopped by a force, the effect of that force."""

    def __init__(self, forces: SumForces) -> None:
        self.s, self.forces = forces.s, forces

    @in_taichi_thread
    def name_failing_effect(self) -> np.ndarray:
        """Name the effect whose force on the failing particle is the largest or not finite.

        Return for each world the longest step (s) for which that force would be finite; 0 if there is none,
        or if no force has stopped the world.
        """
        longest = np.zeros(self.s.worlds)
        self._name(longest)
        return longest

    @ti.kernel
    def _name(self, longest: ti.types.ndarray()):  # type: ignore[valid-type]
        for w in range(self.s.worlds):
            if self.s.failing_effect[w] == ASKED:
                for i in range(self.s.count[w]):
                    if self.s.id[w, i] == self.s.failing_particle[w]:
                        index, step = self.find_failing_effect(w, i, self.s.failure_time[w])
                        self.s.failing_effect[w], longest[w] = index, ti.cast(step, ti.f64)

    @ti.func
    def force_by_other(self, effect: ti.template(), w, i, j, t, dt):  # type: ignore[valid-type]
        """Return the load that j exerts on i by one law at the end of a step of dt (s), with their stored
        contact history.

        It is zero within a rigid body if the law does not act there.
        """
        s = self.s
        d = self.forces.domain.separation(w, s.position[w, i], s.position[w, j], t)
        first, second, sign = i, j, ti.cast(1.0, s.real)
        if s.id[w, i] > s.id[w, j]:
            first, second, sign = j, i, ti.cast(-1.0, s.real)
        past = ti.Vector.zero(s.real, max(1, effect.memory))
        if ti.static(effect.memory > 0):
            past = effect.past.stored(w, i, j) + effect.past.stored(w, j, i)
        force, torque_i, torque_j, _ = effect.interaction(
            s, w, first, second, sign * d, d.norm(), past, dt, t
        )
        load = self.forces.loads.wrench(sign * force, ti.select(first == i, torque_i, torque_j))
        if ti.static(effect.short_ranged and not effect.within_bodies):
            load = ti.select(self.forces.half_list.joined(w, i, j), 0.0, load)
        return load

    @ti.func
    def find_failing_effect(self, w, i, t):
        """Return the effect at fault for particle i, and the longest step (s) for which its force would be
        finite.

        The effect is given by its index. Its force on i is the largest or not finite, or its derived quantity
        is not finite.
        """
        s, dt, index = self.s, self.forces.elapsed_time(w), -1
        low, high = 0.0 * dt, dt
        for k in range(1 + HALVINGS):
            step, most, largest = ti.select(k == 0, dt, 0.5 * (low + high)), ti.cast(-1.0, s.real), 0
            for effect in ti.static(self.forces.forces):
                if index < 0 or index == effect.index:
                    force, torque = effect.load(s, w, i, t, step, False)
                    size = self.forces.loads.wrench(force, torque).norm()
                    if finite(most) and not (size <= most):
                        most, largest = size, effect.index
            for effect in ti.static(self.forces.pair_forces):
                if index < 0 or index == effect.index:
                    total = ti.Vector.zero(s.real, self.forces.loads.size)
                    for j in range(s.count[w]):
                        if i != j:
                            total += self.force_by_other(effect, w, i, j, t, step)
                    if finite(most) and not (total.norm() <= most):
                        most, largest = total.norm(), effect.index
            if k == 0:
                index = largest
            elif finite(most):
                low = step
            else:
                high = step
        for solver in ti.static(self.forces.derived_solvers):
            if not finite(solver.size(solver.value[w, i])):
                index, low = solver.effect.index, 0.0 * dt
        return index, low
