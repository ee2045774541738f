"""The forces that a first step begins with, whose laws are asked as well if they can follow that step."""

from tisim.backend.taichi import ti
from tisim.interactions.force_sum import SumForces
from tisim.numerics.ieee import finite
from tisim.worlds.status import WorldStatus


class SumForcesAtStart(SumForces):
    """This phase sums the forces that a first step begins with, at the start or after a world was written to.

    No time has gone by. What lies so deep in each other that the step ahead is too long for it would be far
    apart after that step, and nobody would know: it is found here.
    """

    elapsed = False

    @ti.func
    def interaction(self, law: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        s, past = self.s, self.past(law, w, m)
        force, torque_i, torque_j, memory = law.interaction(
            s, w, i, j, separation, distance, past, self.elapsed_time(w), t
        )
        if ti.static(law.data.offers("interaction")):
            ahead = ti.cast(s.step_ahead[w], s.real)
            later = law.interaction(s, w, i, j, separation, distance, past, ahead, t)
            force = self.unless_not_finite(force, later[0])
        return force, torque_i, torque_j, memory

    @ti.func
    def load_by(self, effect: ti.template(), w, i, t):  # type: ignore[valid-type]
        s = self.s
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        if ti.static(effect.data.offers("load")):
            # In a loop, as it takes long to compile: what acts now, then over the step ahead.
            for turn in range(2):
                dt = ti.select(turn == 0, self.elapsed_time(w), ti.cast(s.step_ahead[w], s.real))
                push, moment = effect.load(s, w, i, t, dt, turn == 0)
                if turn == 0:
                    force, torque = push, moment
                else:
                    force = self.unless_not_finite(force, push)
        else:
            force, torque = effect.load(s, w, i, t, self.elapsed_time(w), self.commits)
        return self.wrench(force, torque)

    @ti.func
    def unless_not_finite(self, force, ahead):
        """Return the force, or the one over the step ahead where that is not finite: no law can follow it."""
        return ti.select(finite(ahead.norm_sqr()), force, ahead)

    @ti.func
    def check(self, w, i, total):
        # Not below infinity: also true of NaN.
        if not finite(total.norm_sqr()):
            # The law at fault is found by a sum over the step.
            self.s.dt[w] = self.s.step_ahead[w]
            self.s.fail_by_force(w, WorldStatus.NOT_FINITE, i)
