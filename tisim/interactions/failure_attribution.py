"""Which force it was that stopped a world: asked afterwards, by a kernel that is compiled only then.

In the kernels of a step the laws of all forces would stand once more for it, and take as long to compile.
"""

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.interactions.force_sum import SumForces
from tisim.numerics.ieee import finite
from tisim.worlds.status import ASKED


@ti.data_oriented
class FailureAttribution:
    """A failure attribution names the force that has stopped each world of a batch that failed by one."""

    def __init__(self, forces: SumForces) -> None:
        self.s, self.forces = forces.s, forces

    @in_taichi_thread
    def name_failing_effect(self) -> None:
        """Name the effect whose force on the failing particle is largest, or not finite, where it was when
        asked."""
        self._name()

    @ti.kernel
    def _name(self):
        for w in range(self.s.worlds):
            if self.s.failing_effect[w] == ASKED:
                for i in range(self.s.count[w]):
                    if self.s.id[w, i] == self.s.failing_particle[w]:
                        self.s.failing_effect[w] = self.find_failing_effect(w, i, self.s.failure_time[w])

    @ti.func
    def force_by_other(self, effect: ti.template(), w, i, j, t):  # type: ignore[valid-type]
        """Return what j does to i by one law, given what they have stored of each other; nothing where both
        are of one rigid body, within which it does not act."""
        s = self.s
        d = self.forces.domain.separation(w, s.position[w, i], s.position[w, j], t)
        first, second, sign = i, j, ti.cast(1.0, s.real)
        if s.id[w, i] > s.id[w, j]:
            first, second, sign = j, i, ti.cast(-1.0, s.real)
        past, dt = ti.Vector.zero(s.real, max(1, effect.memory)), self.forces.elapsed_time(w)
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
        """Return the index of the effect whose force on i is largest, or not finite, or is set to nothing
        finite."""
        s = self.s
        most, index = ti.cast(-1.0, s.real), 0
        for effect in ti.static(self.forces.forces):
            size = self.forces.load_by(effect, w, i, t).norm()
            if finite(most) and not (size <= most):
                most, index = size, effect.index
        for effect in ti.static(self.forces.pair_forces):
            total = ti.Vector.zero(s.real, self.forces.loads.size)
            for j in range(s.count[w]):
                if i != j:
                    total += self.force_by_other(effect, w, i, j, t)
            if finite(most) and not (total.norm() <= most):
                most, index = total.norm(), effect.index
        for solver in ti.static(self.forces.derived_solvers):
            if not finite(solver.size(solver.value[w, i])):
                index = solver.effect.index
        return index
