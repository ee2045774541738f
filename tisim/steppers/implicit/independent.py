"""Particles that do not interact: each takes its own implicit steps, many of them in one launch.

There is no norm over all particles, and a particle waits only for the end of an interval (see intervals.py).
The number of intervals or attempts in a launch does not affect the motion.
"""

from tisim.backend.taichi import ti
from tisim.numerics.ieee import compensated_sum, finite, infinity
from tisim.program.phases import PerParticle
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.attempts import ACCEPTED, HOPELESS, RETRY, SHORTER
from tisim.steppers.implicit.excursion import note_excursion
from tisim.steppers.implicit.saved_state import saved_fields
from tisim.steppers.intervals import LITTLE, beginning, duration
from tisim.steppers.registers import Registers


class IndependentSteps(PerParticle):
    """This phase takes each particle through the intervals of a launch."""

    long = True

    def __init__(self, context: StepContext, solve) -> None:
        super().__init__(context.s)
        moving = tuple(field.name.removesuffix("_before") for field in saved_fields(context.turning))
        before = tuple(field.name for field in saved_fields(context.turning))
        self.registers = Registers(context.s, ("own_dt", *moving), before)
        self.own, self.control = self.registers.state, context.control
        self.solve = self.registers.with_registers(solve)
        self.force_sum = self.registers.with_registers(context.force_sum)

    @ti.func
    def run(self, w, i):
        s = self.s
        self.registers.load(w, i)
        interval, end = s.own_interval[w, i], s.intervals[w] + s.launch_intervals[w]
        elapsed, carry = s.own_elapsed[w, i], s.own_carry[w, i]
        steps, tries, iterations, verdict = ti.i64(0), ti.i64(0), ti.i64(0), ACCEPTED
        aim, attempt_limit = self.control.aim(w), ti.cast(s.attempt_limit[w], ti.i64)
        going = ti.select(interval < end, 1, 0)
        while going > 0:
            begin = beginning(s, self.control, w, interval)
            length = duration(s, self.control, w, interval, begin)
            elapsed, carry, verdict, more_steps, more_tries, more_iterations = self.interval(
                w, i, begin, length, elapsed, carry, attempt_limit - tries, aim
            )
            steps += more_steps
            tries += more_tries
            iterations += more_iterations
            if elapsed < length:
                going = 0
                if verdict == HOPELESS:
                    ti.atomic_max(s.halted[w], 1)
                else:
                    ti.atomic_add(s.underway[w], 1)
            elif s.cut[w] > 0.0:
                going = 0
            else:
                interval, elapsed, carry = interval + 1.0, 0.0, 0.0
                if interval >= end:
                    going = 0
        self.registers.store(w, i)
        s.own_interval[w, i], s.own_elapsed[w, i], s.own_carry[w, i] = interval, elapsed, carry
        ti.atomic_add(s.particle_steps[w], steps)
        ti.atomic_add(s.rejections[w], tries - steps)
        ti.atomic_add(s.solver_iterations[w], iterations)
        ti.atomic_add(s.force_evaluations[w], iterations)

    @ti.func
    def interval(self, w, i, begin, length, start, rounding, attempt_limit, aim):
        """Take a particle through an interval from ``start`` (s) on. Return the time it reaches (s), the end
        unless it is stuck or has used up its attempts; the rounding error of this time; its last verdict; and
        the numbers of its steps, attempts and iterations."""
        s = self.own
        elapsed, carry = start, rounding
        steps, tries, iterations, verdict = ti.i64(0), ti.i64(0), ti.i64(0), ACCEPTED
        while elapsed < length and verdict != HOPELESS and tries < attempt_limit:
            self.solve.save(w, i)
            verdict = RETRY
            while verdict == RETRY:
                speed = ti.cast(s.velocity_before[w, i].norm(), ti.f64)
                target = self.control.step(s, w, s.own_dt[w, i], speed)
                last = target * (1.0 + LITTLE) >= length - elapsed
                dt = ti.select(last, length - elapsed, target)
                verdict, k = self.attempt(w, i, begin + elapsed, dt, aim)
                iterations += k
                tries += 1
                if verdict == ACCEPTED:
                    total, carry = compensated_sum(elapsed, dt, carry, s.count[w])
                    elapsed = ti.select(last, length, total)
                    steps += 1
                    if ti.static(self.control.at_end):
                        note_excursion(s, w, i, self.solve.step_displacement(w, i, ti.cast(dt, s.real)))
                    # A last step that was cut short gives no information about the next one.
                    s.own_dt[w, i] = ti.max(s.own_dt[w, i], ti.cast(ti.select(last, target, 0.0), s.real))
        return elapsed, carry, verdict, steps, tries, iterations

    @ti.func
    def attempt(self, w, i, t, dt, aim):
        """Attempt one step of this length (s). Return the verdict, and the number of iterations."""
        s, solve = self.own, self.solve
        step, end = ti.cast(dt, s.real), t + dt
        v = solve.velocity(w, i, step, solve.jacobian(w, i, end))
        if not solve.reachable(w, i, v, step):
            v = s.velocity_before[w, i]
        solve.advance(w, i, v, step)
        k, verdict, iterating = 1, RETRY, 1
        while iterating > 0:
            # Before the force is written, so that common subexpressions are computed once.
            jacobian = solve.jacobian(w, i, end)
            self.force_sum.single_particle(w, i, end)
            new = solve.velocity(w, i, step, jacobian)
            k += 1
            change, error = ti.cast(infinity(s.count[w]), s.real), ti.cast(0.0, s.real)
            if solve.reachable(w, i, new, step):
                change = solve.phi(w) * step * (new - v).norm()
                v = new
                change += solve.advance(w, i, v, step)
                moved = solve.displacement(w, i, v, step).norm()
                # If nothing changes, nothing moves: 0/0 is no error.
                change = change / ti.select(change > 0.0, moved, 1.0)
                error = solve.error(w, i, step)
                error = error / ti.select(error > 0.0, self.control.scale(s, w, i, moved, step), 1.0)
            ratio, off = ti.cast(change, ti.f64), ti.cast(error, ti.f64)
            solved = self.control.solved(w, ratio)
            if solved or k >= self.control.iterations or not finite(ratio):
                iterating = 0
                accepted = solved and self.control.accepts(w, off)
                target = dt
                # If the longest step stays, this branch spares the next step the wait for the factor.
                if not (accepted and self.control.stays(w, dt, aim, ratio, k, off)):
                    target *= self.control.factor(w, aim, ratio, ti.cast(k, ti.f64), off)
                if accepted:
                    verdict = ACCEPTED
                else:
                    target = ti.min(target, SHORTER * dt)
                    verdict = ti.select(self.control.hopeless(s, w, dt), HOPELESS, RETRY)
                    solve.restore(w, i)
                s.own_dt[w, i] = ti.cast(target, s.real)
        return verdict, k - 1
