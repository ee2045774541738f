"""The phases of an attempt at a step of the trapezoidal rule: an iteration, and the verdict on it."""

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite, infinity
from tisim.program.block_sum import PerBlock
from tisim.program.phases import Item, PerParticle, Phase, Repeat
from tisim.steppers.common import note_displacement
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.attempts import ACCEPTED, HOPELESS, RETRY, SHORTER, length, report_failure


class Iteration(Repeat):
    """This repeat makes iterations of an attempt, until there is a verdict."""

    usual = 2

    def __init__(self, context: StepContext, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.s = context.s

    @ti.func
    def pending(self, w):
        return self.s.iterating[w]


class ChooseTrapezoidStep(Phase):
    """This phase chooses the step; the last one ends exactly on time. Forces will be those of the end of the
    step."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.control = context.s, context.control

    @ti.func
    def run(self, w, _k):
        s = self.s
        dt = length(s, self.control, w)
        s.dt[w] = dt
        s.time[w] = s.time_before[w] + dt
        s.iterating[w], s.solver_iteration[w] = 1, 1


class PredictEnd(PerParticle):
    """This phase makes the first iterate, K = 1, with the force at the beginning of the step."""

    def __init__(self, solve) -> None:
        super().__init__(solve.s)
        self.solve = solve

    @ti.func
    def run(self, w, i):
        s, solve = self.s, self.solve
        dt = ti.cast(s.dt[w], s.real)
        v = solve.velocity(w, i, dt, solve.jacobian(w, i, s.time[w]))
        if not solve.reachable(w, i, v, dt):
            v = s.velocity_before[w, i]
        solve.advance(w, i, v, dt)
        moved = ti.cast(solve.displacement(w, i, v, dt), ti.f64)
        note_displacement(s, w, moved - s.axes(s.frame, w) * s.dt[w])


class Correct(PerBlock):
    """This phase makes the next iterate, and sums change, displacement, error, and what the error is compared
    with (m)."""

    def __init__(self, context: StepContext, sums, solve) -> None:
        super().__init__(sums)
        self.control, self.solve = context.control, solve

    @ti.func
    def each(self, w, i):
        s, solve = self.s, self.solve
        dt = ti.cast(s.dt[w], s.real)
        last = s.velocity[w, i]
        v = solve.velocity(w, i, dt, solve.jacobian(w, i, s.time[w]))
        change = ti.cast(infinity(s.count[w]), s.real)
        if solve.reachable(w, i, v, dt):
            step = solve.phi(w) * dt * (v - last)
            change = step.norm() + solve.advance(w, i, v, dt)
            note_displacement(s, w, ti.cast(step, ti.f64))
        s.iterate_change[w, i] = change
        moved = solve.displacement(w, i, v, dt).norm()
        error, scale = solve.error(w, i, dt), self.control.scale(s, w, i, moved, dt)
        return ti.cast(ti.Vector([change, moved, error, scale]), ti.f64)


class JudgeIteration(Phase):
    """This phase judges whether the iteration is solved, to go on, or to be given up."""

    def __init__(self, context: StepContext, sums) -> None:
        self.s, self.control, self.sums = context.s, context.control, sums

    @ti.func
    def run(self, w, _k):
        s = self.s
        total = self.sums.total(w)
        change, error = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        # Nothing moves where nothing changes: 0/0 is no error.
        if total[0] != 0.0:
            change = total[0] / total[1]
        if total[2] > 0.0:
            error = total[2] / total[3]
        k = s.solver_iteration[w] + 1
        s.solver_iteration[w] = k
        s.solver_iterations[w] += 1
        s.force_evaluations[w] += 1
        s.verdict[w] = RETRY
        solved = self.control.solved(w, change)
        if solved or k >= self.control.iterations or not finite(change):
            if solved and self.control.accepts(w, error):
                s.verdict[w] = ACCEPTED
            elif self.control.hopeless(s, w, s.dt[w]):
                s.verdict[w] = HOPELESS
                report_failure(s, w)
            factor = self.control.factor(w, self.control.aim(w), change, ti.cast(k, ti.f64), error)
            # A step that was not accepted would fail again in the same way if it were as long.
            s.next_dt[w] = s.dt[w] * ti.select(s.verdict[w] == ACCEPTED, factor, ti.min(factor, SHORTER))
            s.iterating[w] = 0
