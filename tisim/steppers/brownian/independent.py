"""Brownian particles that do not interact: each takes its own steps, many of them in one launch.

They meet at every multiple of the longest step. Such an interval counts as a step of the world (see
intervals.py). A step of a particle is numbered by its interval and by its place in it, so that the number of
intervals or steps in a launch does not affect the noise.
"""

from tisim.backend.taichi import ti
from tisim.numerics.ieee import compensated_sum, finite
from tisim.program.phases import PerParticle
from tisim.state.fields import Field
from tisim.state.status import WorldStatus
from tisim.steppers.brownian.drift_limit import fault
from tisim.steppers.context import StepContext
from tisim.steppers.intervals import LITTLE, OWN_CLOCK, EndIntervals, beginning, duration
from tisim.steppers.registers import Registers

OWN_BROWNIAN_FIELDS = (
    *OWN_CLOCK,
    Field("own_steps", "", 1, "keep", integer=True, scratch=True),
    Field("own_fault", "", 1, "keep", integer=True, scratch=True),
)
"""The progress of a particle: its time, the number of its steps in the interval, and its fault, a status of
the world, or 0."""
AHEAD = 8
"""Number of synchronisation intervals for which the noise of the first step, usually the only one, is drawn
together, in vectors."""


@ti.func
def euler_step(s, fluid: ti.template(), w, i, mobility, push_velocity, t, dt, g):  # type: ignore[valid-type]
    """Return the drift velocity (m/s), u + F/(6 pi eta R), and the position (m) after a step: r plus
    dt times this velocity + sqrt(2 D dt) g."""
    velocity = fluid.flow(w, s.position[w, i], t) + push_velocity
    width = ti.sqrt(2.0 * dt * fluid.heat(w) * mobility)
    return velocity, s.position[w, i] + (dt * velocity + width * g)


class IndependentBrownianSteps(PerParticle):
    """This phase takes each particle through the intervals of a launch."""

    long = True

    def __init__(self, context: StepContext, fluid) -> None:
        super().__init__(context.s)
        self.registers = Registers(context.s, ("position", "velocity", "force"), ())
        self.own, self.control, self.domain = self.registers.state, context.control, context.domain
        self.fluid = self.registers.with_registers(fluid)
        self.force_sum = self.registers.with_registers(context.force_sum)
        self.operators, self.forced = context.operators, context.forced
        # Whether fixed particles may be freed: operators are then called for them after each interval.
        self.wakes = any(operator.data.acts_on_fixed for operator in context.operators)

    @ti.func
    def run(self, w, i):
        self.advance(w, i)

    @ti.func
    def advance(self, w, i):
        """Take particle i through the intervals of the launch, from its present time on."""
        s = self.s
        self.registers.load(w, i)
        interval, end = s.own_interval[w, i], s.intervals[w] + s.launch_intervals[w]
        elapsed, carry, before = s.own_elapsed[w, i], s.own_carry[w, i], s.own_steps[w, i]
        attempts, going, short = 0, self.able(w, i), 0
        attempt_limit, cut = s.attempt_limit[w], s.cut[w]
        while going > 0 and interval < end:
            kicks = [ti.Vector([0.0] * AHEAD, s.real) for _ in ti.static(range(3))]
            lanes = ti.min(AHEAD, ti.cast(end - interval, ti.i32))
            if self.held(w, i) > 0:
                # A fixed particle takes one interval, without noise, and may then be free.
                lanes = 1
            else:
                for lane in range(AHEAD):
                    g = self.fluid.normals(w, i, self.number(interval + lane))
                    for k in ti.static(range(3)):
                        kicks[k][lane] = g[k]
            for lane in range(lanes):
                if going > 0:
                    kick = ti.Vector([kicks[0][lane], kicks[1][lane], kicks[2][lane]])
                    elapsed, carry, steps, going, over = self.interval(
                        w, i, interval, kick, elapsed, carry, before, attempt_limit - attempts
                    )
                    attempts += steps - before
                    before = steps
                    if over == 0:
                        short, going = going, 0
                    elif cut > 0.0:
                        going = 0
                    else:
                        interval, elapsed, carry, before = interval + 1.0, 0.0, 0.0, 0
        if self.able(w, i) == 0 and s.own_fault[w, i] == 0:
            # The particle waits at the end of the launch for the others.
            interval, elapsed, carry, before = end, 0.0, 0.0, 0
        self.registers.store(w, i)
        s.own_interval[w, i], s.own_elapsed[w, i], s.own_carry[w, i] = interval, elapsed, carry
        s.own_steps[w, i] = before
        if short > 0:
            ti.atomic_add(s.underway[w], 1)
        ti.atomic_add(s.particle_steps[w], attempts)

    @ti.func
    def number(self, interval):
        """Return the number of the first step in an interval."""
        return ti.cast(interval, ti.i64) << 32

    @ti.func
    def able(self, w, i):
        """Return 1 if a particle can still advance, else 0: it exists, has no fault, and can move or be
        freed."""
        s = self.s
        there = s.mass[w, i] > 0.0 and s.own_fault[w, i] == 0
        able = ti.cast(there, ti.i32)
        if ti.static(not self.wakes):
            able *= self.fluid.mobile(w, i)
        return able

    @ti.func
    def held(self, w, i):
        """Return 1 for a fixed particle that an operator may free, else 0."""
        held = 0
        if ti.static(self.wakes):
            held = 1 - self.fluid.mobile(w, i)
        return held

    @ti.func
    def interval(self, w, i, interval, kick, start, rounding, before, most):
        """Take a particle through an interval from ``start`` (s) on, ``before`` steps after its beginning.

        Return the time it reaches (s), the end unless stopped or after ``most`` further steps; the rounding
        error of this time; the number of its steps in the interval; whether it can go on; and whether it is
        at the end. ``kick`` are the normal numbers of the first step in the interval.
        """
        begin = beginning(self.s, self.control, w, interval)
        length = duration(self.s, self.control, w, interval, begin)
        elapsed, carry = start, rounding
        steps, going, g = before, 1, kick
        while elapsed < length and going > 0 and steps - before < most:
            t = begin + elapsed
            # A fixed particle stays until the end of the interval.
            dt, total = length - elapsed, length
            if self.held(w, i) == 0:
                # An operator may have changed the radius in the last step.
                mobility = self.fluid.mobility(w, i)
                if ti.static(self.forced):
                    self.force_sum.single_particle(w, i, t)
                push_velocity = self.fluid.push_velocity(w, i, mobility)
                remaining = dt
                dt = ti.cast(self.control.longest(w), ti.f64)
                if not self.control.easy(self.own, w, i, push_velocity):
                    rate = self.control.rate(self.own, w, i, push_velocity)
                    dt = self.control.step(w, rate)
                    if self.control.hopeless(w, rate):
                        self.stop(w, i, fault(rate))
                        going = 0
                if going > 0:
                    total, carry = compensated_sum(elapsed, dt, carry, self.s.count[w])
                    if dt * (1.0 + LITTLE) >= remaining:
                        dt, total = remaining, length
                    if steps > 0:
                        g = self.fluid.normals(w, i, self.number(interval) + steps)
                    self.move(w, i, mobility, push_velocity, t, dt, g)
            if going > 0:
                self.end_step(w, i, t, dt)
                if self.s.own_fault[w, i] == 0:
                    elapsed = total
                    steps += 1
                going = self.able(w, i)
        return elapsed, carry, steps, going, ti.select(elapsed < length, 0, 1)

    @ti.func
    def move(self, w, i, mobility, push_velocity, t, dt, g):
        """Move a particle by a step."""
        s, step = self.own, ti.cast(dt, self.s.real)
        s.velocity[w, i], s.position[w, i] = euler_step(
            s, self.fluid, w, i, mobility, push_velocity, t, step, g
        )

    @ti.func
    def end_step(self, w, i, t, dt):
        """Call the operators for a particle after a step of dt (s) from t (s) on, and put it into the
        domain."""
        s, step = self.own, ti.cast(dt, self.s.real)
        for operator in ti.static(self.operators):
            operator.particle(s, w, i, t + dt, step)
        r = s.position[w, i]
        if not finite(r.norm_sqr()):
            self.stop(w, i, WorldStatus.NOT_FINITE)
        elif self.domain.lost(w, r):
            self.stop(w, i, WorldStatus.POSITION_LOST)
        else:
            s.position[w, i] = self.domain.wrap(w, r, t + dt)

    @ti.func
    def stop(self, w, i, fault):
        """Stop a particle; its world ends with the launch."""
        s = self.s
        s.own_fault[w, i] = fault
        ti.atomic_max(s.halted[w], 1)


class EndBrownianIntervals(EndIntervals):
    """This phase ends the intervals, or finds the first stopped particle."""

    def __init__(self, context: StepContext) -> None:
        super().__init__(context)
        self.forced = context.forced

    @ti.func
    def report_failure(self, w):
        """Record the particle that stopped first, and when."""
        s = self.s
        first = self.slowest(w)
        self.stop(w, first, s.own_fault[w, first])
        if ti.static(self.forced):
            s.ask(w, s.time[w])
