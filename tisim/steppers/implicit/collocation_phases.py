"""The phases of an attempt at a collocation step: sweeps over its stages, and the verdict, from their
convergence and the error of the step."""

import numpy as np

from tisim.backend.taichi import ti
from tisim.numerics import elementary
from tisim.numerics.ieee import finite, infinity
from tisim.program.phases import Item, PerParticle, Phase, Repeat
from tisim.program.scans import PerBlock
from tisim.steppers.common import note_displacement
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.attempts import ACCEPTED, FAR_SHORTER, SHORTER, conclude, length, relative


class Forget(Phase):
    """This phase discards the polynomial of the last step after impacts, which make it useless as a
    prediction."""

    def __init__(self, context: StepContext) -> None:
        self.s = context.s

    @ti.func
    def run(self, w, _k):
        if self.s.events[w] > 0:
            self.s.last_dt[w] = 0.0


class ChooseCollocationStep(Phase):
    """This phase chooses the step, and starts at the first stage after its beginning."""

    def __init__(self, context: StepContext, stages) -> None:
        self.s, self.control, self.stages = context.s, context.control, stages

    @ti.func
    def run(self, w, _k):
        s = self.s
        dt = length(s, self.control, w)
        s.dt[w] = dt
        self.stages.extrapolate(w, ti.select(s.last_dt[w] > 0.0, dt / s.last_dt[w], 0.0))
        s.sweeping[w], s.sweep[w], s.stage[w] = 1, 1, 1
        s.stage_change[w], s.last_change[w], s.out_of_range[w] = 0.0, 0.0, 0
        s.time[w] = s.time_before[w] + dt * self.stages.c[1]


class OfStages(PerParticle):
    """This phase is a loop over particles that has access to the stages."""

    def __init__(self, stages) -> None:
        super().__init__(stages.s)
        self.stages = stages


class PredictStages(OfStages):
    """This phase predicts the rates at all stages from the polynomial of the last step; at the first they are
    known."""

    @ti.func
    def run(self, w, i):
        s, stages = self.s, self.stages
        stages.put(s.stage_acceleration, w, i, 0, s.force_before[w, i] / s.mass[w, i])
        if ti.static(stages.turning):
            stages.put(s.stage_turning, w, i, 0, s.torque_before[w, i] / stages.inertia(w, i))
        for now, last in ti.static(stages.rates):
            for j in range(1, stages.number):
                rate = stages.at(now, w, i, 0)
                if s.last_dt[w] > 0.0:
                    rate *= 0.0
                    for k in range(stages.number):
                        rate += ti.cast(stages.predict[w, j, k], s.real) * stages.at(last, w, i, k)
                stages.put(now, w, i, j, rate)


class StageSweep(Repeat):
    """This repeat goes through the stages, sweep after sweep, until there is a verdict."""

    def __init__(self, context: StepContext, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.s, self.usual = context.s, context.stepper.data.stages - 1

    @ti.func
    def pending(self, w):
        return self.s.sweeping[w]


class Place(OfStages):
    """This phase puts particles at their present approximate places at the stage."""

    @ti.func
    def run(self, w, i):
        s, stages = self.s, self.stages
        dt, stage = ti.cast(s.dt[w], s.real), s.stage[w]
        r = s.position_before[w, i] + stages.displacement(w, i, stage, dt)
        if stages.sound(w, r):
            here = stages.domain.wrap(w, r, s.time[w])
            moved = stages.domain.nearest(w, s.position[w, i], here, s.time[w])
            note_displacement(s, w, ti.cast(moved, ti.f64))
            s.position[w, i], s.velocity[w, i] = here, stages.velocity(w, i, stage, dt)
            if ti.static(stages.turning):
                s.spin[w, i] = stages.spin(w, i, stage, dt)
        else:
            ti.atomic_max(s.out_of_range[w], 1)


class TakeStages(PerBlock):
    """This phase stores the rates due to the forces at the stage. It sums their changes as displacements (m),
    and at the last stage the error, the scale of both, and the rounding error of displacements."""

    def __init__(self, context: StepContext, sums, stages) -> None:
        super().__init__(sums)
        self.control, self.stages = context.control, stages
        self.leading = context.control.leading(context.smooth)
        self.eps = float(np.finfo(np.float64 if self.s.real == ti.f64 else np.float32).eps)

    @ti.func
    def each(self, w, i):
        s, stages = self.s, self.stages
        dt, stage = ti.cast(s.dt[w], s.real), s.stage[w]
        new = stages.newest(w, i, stage, dt, s.time[w])
        change = self.take(s.stage_acceleration, w, i, stage, new)
        error, rounding = ti.cast(0.0, s.real), ti.cast(0.0, s.real)
        if ti.static(stages.turning):
            change += s.radius[w, i] * self.take(
                s.stage_turning, w, i, stage, s.torque[w, i] / stages.inertia(w, i)
            )
        s.iterate_change[w, i] = dt * dt * change
        last, scale = stage == stages.number - 1, ti.cast(0.0, s.real)
        if ti.static(self.control.norm == "each") or last:
            scale = self.scale(w, i, dt)
        if last:
            error = dt * dt * self.estimate(s.stage_acceleration, w, i)
            if ti.static(stages.turning):
                error += dt * dt * s.radius[w, i] * self.estimate(s.stage_turning, w, i)
            # Rounding of the position, and of the displacement due to the force.
            rounding = self.eps * (s.position[w, i].norm() + dt * dt * new.norm())
        return self.control.terms(dt * dt * change, error, scale, rounding)

    @ti.func
    def scale(self, w, i, dt):
        """Return the scale (m) of the error of a particle, given its present approximate place at the end."""
        moved = self.stages.displacement(w, i, self.stages.number - 1, dt).norm()
        return self.control.scale(self.s, w, i, moved, dt)

    @ti.func
    def take(self, rate: ti.template(), w, i, stage, new):  # type: ignore[valid-type]
        """Store a rate, and return its change. In the first sweep, later stages are corrected by the same
        error, scaled by ``shape``."""
        s, stages = self.s, self.stages
        off = new - stages.at(rate, w, i, stage)
        stages.put(rate, w, i, stage, new)
        if s.sweep[w] == 1:
            for j in range(stage + 1, stages.number):
                more = ti.cast(stages.shape[w, j] / stages.shape[w, stage], s.real)
                stages.put(rate, w, i, j, stages.at(rate, w, i, j) + more * off)
        return off.norm()

    @ti.func
    def estimate(self, rate: ti.template(), w, i):  # type: ignore[valid-type]
        """Return the estimated error over dt^2: the bound |sum_j d_j rate_j|, or the leading term derived
        from it."""
        total, largest = ti.Vector.zero(self.s.real, 3), ti.cast(0.0, self.s.real)
        for j in range(self.stages.number):
            here = self.stages.at(rate, w, i, j)
            total += ti.cast(self.stages.estimate[j], self.s.real) * here
            largest = ti.max(largest, here.norm())
        error = total.norm()
        if ti.static(self.leading):
            factor, power = ti.static(self.stages.leading)
            error = largest * elementary.pow(factor * error / ti.select(largest > 0.0, largest, 1.0), power)
        return error


class Conclude(OfStages):
    """This phase sets the velocity at the end, and the rates from which the next step is predicted; positions
    are already set."""

    conditional = True

    @ti.func
    def when(self, w):
        return ti.select(self.s.verdict[w] == ACCEPTED, 1, 0)

    @ti.func
    def run(self, w, i):
        s, stages = self.s, self.stages
        dt, last = ti.cast(s.dt[w], s.real), stages.number - 1
        s.velocity[w, i] = stages.velocity(w, i, last, dt)
        if ti.static(stages.turning):
            s.spin[w, i] = stages.spin(w, i, last, dt)
        for now, before in ti.static(stages.rates):
            for k in range(3 * stages.number):
                before[w, i, k] = now[w, i, k]


GUESS = 0.5
"""Contraction of a sweep if none has been measured, and its largest assumed value."""


class JudgeStages(Phase):
    """This phase goes on to the next stage. After the last stage it decides whether the step is solved, needs
    another sweep, or is given up."""

    def __init__(self, context: StepContext, sums, stages) -> None:
        self.s, self.control, self.sums, self.stages = context.s, context.control, sums, stages
        self.order = context.control.order(stages.number, context.smooth)

    @ti.func
    def run(self, w, _k):
        s, last = self.s, self.stages.number - 1
        total = self.control.norms(self.sums.total(w))
        s.force_evaluations[w] += 1
        # A maximum with NaN would ignore the NaN.
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
        change, error = relative(s.stage_change[w], total[2]), relative(total[1], total[2])
        first = s.sweep[w] == 1
        contraction = self.foreseen(w)
        if not first and s.last_change[w] > 0.0:
            contraction = change / s.last_change[w]
            # For later steps the contraction is at least the resolvable one: a change rounded to 0 now is not
            # 0 in longer steps.
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
        """Return the expected contraction: it increases as dt^2 with longer steps and, to be safe, decreases
        only as dt with shorter ones."""
        s = self.s
        factor = ti.cast(GUESS, ti.f64)
        if s.measured_dt[w] > 0.0:
            ratio = s.dt[w] / s.measured_dt[w]
            factor = ti.min(factor, s.contraction[w] * ratio * ti.max(1.0, ratio))
        return factor

    @ti.func
    def decide(self, w, solved, contraction, error):
        """Set the verdict, and the length of the next step."""
        s = self.s
        s.sweeping[w] = 0
        # A contraction that was only extrapolated may be outdated: it is no reason for a shorter step.
        current_contraction = ti.select(s.sweep[w] > 1 or not solved, contraction, 0.0)
        factor = self.control.factor(w, current_contraction, error, self.order)
        accepted = solved and self.control.accepts(w, error)
        conclude(self.control, s, w, accepted, factor, ti.select(solved, SHORTER, FAR_SHORTER))
        if s.verdict[w] == ACCEPTED:
            s.last_dt[w] = s.dt[w]
