"""The phases of an attempt at a step of collocation: sweeps over its stages, and the verdict on them."""

from tisim._taichi import ti
from tisim.blocks import PerBlock
from tisim.program import PerParticle, Phase, Repeat
from tisim.steppers.attempts import ACCEPTED, HOPELESS, SHORTER, TRIED, accuse, length
from tisim.steppers.phases import note_stride

GUESS = 0.5
"""Taken for the factor by which a sweep makes the error smaller where nothing is known of it, and at most."""
DIVERGED = 0.5
"""The longest that a second attempt may be where sweeps did not converge, in lengths of the first."""


class Forget(Phase):
    """After impacts the past says nothing about what is to come."""

    def __init__(self, s) -> None:
        self.s = s

    @ti.func
    def run(self, w, _k):
        if self.s.events[w] > 0:
            self.s.last_dt[w] = 0.0


class Try(Phase):
    """Choose the step, and begin at the first stage after its beginning."""

    def __init__(self, parts, stages) -> None:
        self.s, self.control, self.stages = parts.s, parts.control, stages

    @ti.func
    def run(self, w, _k):
        s = self.s
        dt = length(s, self.control, w)
        s.dt[w] = dt
        self.stages.extrapolate(w, ti.select(s.last_dt[w] > 0.0, dt / s.last_dt[w], 0.0))
        s.sweeping[w], s.sweep[w], s.stage[w] = 1.0, 1.0, 1.0
        s.sweep_change[w], s.last_change[w], s.unsound[w] = 0.0, 0.0, 0.0
        s.time[w] = s.time_before[w] + dt * self.stages.c[1]


class OfStages(PerParticle):
    """A loop over particles that knows the stages."""

    def __init__(self, stages) -> None:
        super().__init__(stages.s)
        self.stages = stages


class Predict(OfStages):
    """The rates at all stages, from the polynomial of the last step; at the first they are known."""

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


class Sweep(Repeat):
    """Stage after stage, again and again, until there is a verdict."""

    def __init__(self, s, items) -> None:
        super().__init__(items)
        self.s = s

    @ti.func
    def pending(self, w):
        return ti.cast(self.s.sweeping[w], ti.i32)


class Place(OfStages):
    """Put particles where they are at the stage, as far as is known."""

    @ti.func
    def run(self, w, i):
        s, stages = self.s, self.stages
        dt, stage = ti.cast(s.dt[w], s.real), ti.cast(s.stage[w], ti.i32)
        r = s.position_before[w, i] + stages.displacement(w, i, stage, dt)
        if stages.sound(w, r):
            here = stages.domain.wrap(w, r)
            moved = stages.domain.nearest(w, s.position[w, i], here)
            note_stride(s, w, ti.cast(moved, ti.f64))
            s.position[w, i], s.velocity[w, i] = here, stages.velocity(w, i, stage, dt)
            if ti.static(stages.turning):
                s.spin[w, i] = stages.spin(w, i, stage, dt)
        else:
            ti.atomic_max(s.unsound[w], 1.0)


class Take(PerBlock):
    """The rates that the forces at the stage give; sums of their change, as displacements (m), and at the
    last stage of the error and of what both are compared with."""

    def __init__(self, parts, sums, stages) -> None:
        super().__init__(sums)
        self.control, self.stages = parts.control, stages

    @ti.func
    def each(self, w, i):
        s, stages = self.s, self.stages
        dt, stage = ti.cast(s.dt[w], s.real), ti.cast(s.stage[w], ti.i32)
        new = stages.newest(w, i, stage, dt, s.time[w])
        change = self.take(s.stage_acceleration, w, i, stage, new)
        error, scale = ti.cast(0.0, s.real), ti.cast(0.0, s.real)
        if ti.static(stages.turning):
            change += s.radius[w, i] * self.take(
                s.stage_turning, w, i, stage, s.torque[w, i] / stages.inertia(w, i)
            )
        s.iterate_change[w, i] = dt * dt * change
        if stage == stages.number - 1:
            error = dt * dt * self.estimate(s.stage_acceleration, w, i)
            if ti.static(stages.turning):
                error += dt * dt * s.radius[w, i] * self.estimate(s.stage_turning, w, i)
            scale = self.control.scale(s, w, i, stages.displacement(w, i, stage, dt).norm(), dt)
        return ti.cast(ti.Vector([dt * dt * change, error, scale]), ti.f64)

    @ti.func
    def take(self, rate: ti.template(), w, i, stage, new):  # type: ignore[valid-type]
        """Note a rate; how much it differs from what was known. Later stages are off alike (``shape``)."""
        s, stages = self.s, self.stages
        off = new - stages.at(rate, w, i, stage)
        stages.put(rate, w, i, stage, new)
        if s.sweep[w] == 1.0:
            for j in range(stage + 1, stages.number):
                more = ti.cast(stages.shape[w, j] / stages.shape[w, stage], s.real)
                stages.put(rate, w, i, j, stages.at(rate, w, i, j) + more * off)
        return off.norm()

    @ti.func
    def estimate(self, rate: ti.template(), w, i):  # type: ignore[valid-type]
        """The error over dt^2: |sum_j d_j rate_j|, which bounds it, or what that says of its leading term."""
        total, largest = ti.Vector.zero(self.s.real, 3), ti.cast(0.0, self.s.real)
        for j in range(self.stages.number):
            here = self.stages.at(rate, w, i, j)
            total += ti.cast(self.stages.estimate[j], self.s.real) * here
            largest = ti.max(largest, here.norm())
        error = total.norm()
        if ti.static(self.control.at_end):
            factor, power = ti.static(self.stages.leading)
            error = largest * ti.pow(factor * error / ti.select(largest > 0.0, largest, 1.0), power)
        return error


class Judge(Phase):
    """To the next stage; after the last one: is the step solved, to be swept again, or to be given up?"""

    def __init__(self, parts, sums, stages) -> None:
        self.s, self.control, self.sums, self.stages = parts.s, parts.control, sums, stages
        self.order = parts.control.order(stages.number)

    @ti.func
    def run(self, w, _k):
        s, last = self.s, self.stages.number - 1
        total = self.sums.total(w)
        s.force_evaluations[w] += 1
        # Not below infinity: also true of NaN, which a maximum would lose.
        if not (total[0] < ti.math.inf) or s.unsound[w] > 0.0:
            total[0] = ti.math.inf
        s.sweep_change[w] = ti.max(s.sweep_change[w], total[0])
        stage = ti.cast(s.stage[w], ti.i32)
        if stage < last and s.sweep_change[w] < ti.math.inf:
            s.stage[w] = stage + 1
        else:
            self.judge(w, total)
            s.stage[w], s.sweep_change[w] = 1.0, 0.0
            s.sweep[w] += 1.0
            s.solver_iterations[w] += 1
        here = self.stages.c[ti.cast(s.stage[w], ti.i32)]
        s.time[w] = s.time_before[w] + s.dt[w] * here

    @ti.func
    def judge(self, w, total):
        """At the end of a sweep."""
        s = self.s
        change, error = s.sweep_change[w], ti.cast(0.0, ti.f64)
        # Nothing moves where nothing changes: 0/0 is no error.
        if change > 0.0:
            change /= total[2]
        if total[1] > 0.0:
            error = total[1] / total[2]
        first = s.sweep[w] == 1.0
        contraction = self.foreseen(w)
        if not first and s.last_change[w] > 0.0:
            contraction = change / s.last_change[w]
            s.contraction[w], s.measured_dt[w] = contraction, s.dt[w]
        s.last_change[w] = change
        solved = change * contraction < ti.math.inf and self.control.solved(w, change * contraction)
        if solved or (not first and not (contraction < 1.0)) or s.sweep[w] >= self.control.sweeps:
            self.decide(w, solved, contraction, error)
        elif not (change < ti.math.inf):
            self.decide(w, False, change, error)

    @ti.func
    def foreseen(self, w):
        """What a sweep multiplies the error by: it grows as dt^2 and, to be safe, falls as dt only."""
        s = self.s
        factor = ti.cast(GUESS, ti.f64)
        if s.measured_dt[w] > 0.0:
            ratio = s.dt[w] / s.measured_dt[w]
            factor = ti.min(factor, s.contraction[w] * ratio * ti.max(1.0, ratio))
        return factor

    @ti.func
    def decide(self, w, solved, contraction, error):
        """The verdict, and how long the next step is to be."""
        s = self.s
        s.sweeping[w], s.verdict[w] = 0.0, TRIED
        # One that is only foreseen may be of long ago: it is no reason for a shorter step.
        known = ti.select(s.sweep[w] > 1.0 or not solved, contraction, 0.0)
        factor = self.control.factor(w, known, error, self.order)
        if solved and self.control.accepts(w, error):
            s.verdict[w], s.last_dt[w] = ACCEPTED, s.dt[w]
        else:
            # A step that was not accepted would fail again in the same way if it were as long.
            factor = ti.min(factor, ti.select(solved, SHORTER, DIVERGED))
            if self.control.hopeless(s, w, s.dt[w]):
                s.verdict[w] = HOPELESS
                accuse(s, w)
        s.next_dt[w] = s.dt[w] * factor


class Conclude(OfStages):
    """The velocity at the end, and what the next step is predicted from; positions are there already."""

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
