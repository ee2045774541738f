"""The verdict on an attempt at a step of collocation: from how its sweeps converge, and from its error."""

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite, infinity
from tisim.program.phases import Phase
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.attempts import ACCEPTED, HOPELESS, RETRY, SHORTER, report_failure

GUESS = 0.5
"""This is taken for the factor by which a sweep makes the error smaller where nothing is known of it, and at
most."""
DIVERGED = 0.5
"""A second attempt may be at most so long where sweeps did not converge, in lengths of the first."""


class JudgeStages(Phase):
    """This phase goes on to the next stage; after the last one it judges whether the step is solved, to be
    swept again, or to be given up."""

    def __init__(self, context: StepContext, sums, stages) -> None:
        self.s, self.control, self.sums, self.stages = context.s, context.control, sums, stages
        self.order = context.control.order(stages.number, context.smooth)

    @ti.func
    def run(self, w, _k):
        s, last = self.s, self.stages.number - 1
        total = self.control.norms(self.sums.total(w))
        s.force_evaluations[w] += 1
        # A maximum would lose NaN.
        if not finite(total[0]) or s.out_of_range[w] > 0:
            total[0] = infinity(s.count[w])
        s.stage_change[w] = ti.max(s.stage_change[w], total[0])
        stage = s.stage[w]
        if stage < last and finite(s.stage_change[w]):
            s.stage[w] = stage + 1
        else:
            self.judge(w, total)
            s.stage[w], s.stage_change[w] = 1, 0.0
            s.sweep[w] += 1
            s.solver_iterations[w] += 1
        here = self.stages.c[s.stage[w]]
        s.time[w] = s.time_before[w] + s.dt[w] * here

    @ti.func
    def judge(self, w, total):
        """Judge a sweep at its end."""
        s = self.s
        change, error = s.stage_change[w], ti.cast(0.0, ti.f64)
        # Nothing moves where nothing changes: 0/0 is no error.
        if change > 0.0:
            change /= total[2]
        if total[1] > 0.0:
            error = total[1] / total[2]
        first = s.sweep[w] == 1
        contraction = self.foreseen(w)
        if not first and s.last_change[w] > 0.0:
            contraction = change / s.last_change[w]
            # For later steps no less than can be resolved: what is rounded away now is not 0 in longer ones.
            resolved = total[3] / total[2] / s.last_change[w]
            s.contraction[w] = ti.select(resolved > contraction, resolved, contraction)
            s.measured_dt[w] = s.dt[w]
        s.last_change[w] = change
        solved = finite(change * contraction) and self.control.solved(w, change * contraction)
        if solved or (not first and not (contraction < 1.0)) or s.sweep[w] >= self.control.sweeps:
            self.decide(w, solved, contraction, error)
        elif not finite(change):
            self.decide(w, False, change, error)

    @ti.func
    def foreseen(self, w):
        """Return what a sweep is foreseen to multiply the error by: it grows as dt^2 and, to be safe, falls
        as dt only."""
        s = self.s
        factor = ti.cast(GUESS, ti.f64)
        if s.measured_dt[w] > 0.0:
            ratio = s.dt[w] / s.measured_dt[w]
            factor = ti.min(factor, s.contraction[w] * ratio * ti.max(1.0, ratio))
        return factor

    @ti.func
    def decide(self, w, solved, contraction, error):
        """Set the verdict, and how long the next step is to be."""
        s = self.s
        s.sweeping[w], s.verdict[w] = 0, RETRY
        # One that is only foreseen may be of long ago: it is no reason for a shorter step.
        current_contraction = ti.select(s.sweep[w] > 1 or not solved, contraction, 0.0)
        factor = self.control.factor(w, current_contraction, error, self.order)
        if solved and self.control.accepts(w, error):
            s.verdict[w], s.last_dt[w] = ACCEPTED, s.dt[w]
        else:
            # A step that was not accepted would fail again in the same way if it were as long.
            factor = ti.min(factor, ti.select(solved, SHORTER, DIVERGED))
            if self.control.hopeless(s, w, s.dt[w]):
                s.verdict[w] = HOPELESS
                report_failure(s, w)
        s.next_dt[w] = s.dt[w] * factor
