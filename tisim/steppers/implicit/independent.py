"""Particles that do not feel each other: each takes its own implicit steps, many of them in one go.

There is no norm over all of them and nothing to wait for. They meet at every multiple of the longest step, a
window, which is what counts as a step of the world. Where each of them is between two meetings is kept, so
that a launch may end there: how many windows or steps it takes them through makes no difference to what they
do.
"""

from tisim.backend.taichi import ti
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.attempts import ACCEPTED, HOPELESS, SHORTER, TRIED
from tisim.steppers.implicit.registers import Registers
from tisim.steppers.implicit.saved_state import kept
from tisim.steppers.implicit.span import went
from tisim.worlds.program import PerParticle, Phase
from tisim.worlds.state import Field, WorldStatus

LAUNCH = 2**20
"""Windows of a launch at most, of all particles together, where more than WINDOWS of them; and attempts at a
step: about a second."""
WINDOWS = 64
LITTLE = 1e-6
"""Of a window or step: a remainder as small as rounding leaves is not worth one of its own."""
PLACE = tuple(
    Field(name, unit, 1, "keep", scratch=True, double=True)
    for name, unit in (("own_window", ""), ("own_elapsed", "s"), ("own_carry", "s"))
)
"""Where a particle is on its way: the number of its window, how far it is in it, and the rounding error of
that."""
KEEPS = ("windows", "stretch_windows", "stuck", "allowance")


class Stretch(Phase):
    """The windows of a launch: up to the end, to the next time at which somebody looks, or to as many as are
    asked for; and the attempts of a particle. What an earlier launch has left is done first.

    The world's time is counted in windows, so that it does not drift.
    """

    def __init__(self, context: StepContext) -> None:
        self.s, self.control = context.s, context.control
        self.most = max(WINDOWS, LAUNCH // (self.s.worlds * self.s.capacity))

    @ti.func
    def run(self, w, _k):
        s = self.s
        going = s.underway[w]
        if going == 0:
            going = s.count[w]
            window = ti.cast(self.control.longest(w), ti.f64)
            until = ti.min(s.pause_time[w], s.end[w])
            wanted = ti.ceil(until / window - LITTLE) - s.windows[w]
            allowed = ti.cast(ti.min(s.step_limit[w] - s.steps[w], self.most), ti.f64)
            s.stretch_windows[w], s.stuck[w] = ti.max(1.0, ti.min(wanted, allowed)), 0.0
        s.allowance[w] = ti.max(WINDOWS, LAUNCH // (s.worlds * ti.max(1, going)))
        s.underway[w] = 0


@ti.func
def beginning(s, control: ti.template(), w, window):  # type: ignore[valid-type]
    """When a window begins; none does after the end, and the first of all at 0. s, f64."""
    length = ti.cast(control.longest(w), ti.f64)
    over = window > 0.0 and (window + LITTLE) * length >= s.end[w]
    return ti.select(over, s.end[w], window * length)


@ti.func
def duration(s, control: ti.template(), w, window, begin):  # type: ignore[valid-type]
    """Of a window that begins then; one that is cut ends there. s, f64."""
    length = beginning(s, control, w, window + 1.0) - begin
    return ti.select(s.cut[w] > 0.0, ti.min(length, s.cut[w]), length)


@ti.func
def own_time(s, control: ti.template(), w, i):  # type: ignore[valid-type]
    """How far a particle has come. s, f64."""
    return beginning(s, control, w, s.own_window[w, i]) + s.own_elapsed[w, i]


class Alone(PerParticle):
    """A particle through the windows of a launch."""

    long = True

    def __init__(self, context: StepContext, solve) -> None:
        super().__init__(context.s)
        moving = tuple(field.name.removesuffix("_before") for field in kept(context.turning))
        before = tuple(field.name for field in kept(context.turning))
        self.registers = Registers(context.s, ("own_dt", *moving), before)
        self.own, self.control = self.registers.state, context.control
        self.solve, self.summed = self.registers.given(solve), self.registers.given(context.force_sum)

    @ti.func
    def run(self, w, i):
        s = self.s
        self.registers.load(w, i)
        window, end = s.own_window[w, i], s.windows[w] + s.stretch_windows[w]
        elapsed, carry = s.own_elapsed[w, i], s.own_carry[w, i]
        steps, tries, iterations, verdict = ti.i64(0), ti.i64(0), ti.i64(0), ACCEPTED
        aim, allowance = self.control.aim(w), ti.cast(s.allowance[w], ti.i64)
        going = ti.select(window < end, 1, 0)
        while going > 0:
            begin = beginning(s, self.control, w, window)
            length = duration(s, self.control, w, window, begin)
            elapsed, carry, verdict, more_steps, more_tries, more_iterations = self.window(
                w, i, begin, length, elapsed, carry, allowance - tries, aim
            )
            steps += more_steps
            tries += more_tries
            iterations += more_iterations
            if elapsed < length:
                going = 0
                if verdict == HOPELESS:
                    ti.atomic_max(s.stuck[w], 1.0)
                else:
                    ti.atomic_add(s.underway[w], 1)
            elif s.cut[w] > 0.0:
                going = 0
            else:
                window, elapsed, carry = window + 1.0, 0.0, 0.0
                if window >= end:
                    going = 0
        self.registers.store(w, i)
        s.own_window[w, i], s.own_elapsed[w, i], s.own_carry[w, i] = window, elapsed, carry
        ti.atomic_add(s.particle_steps[w], steps)
        ti.atomic_add(s.rejections[w], tries - steps)
        ti.atomic_add(s.solver_iterations[w], iterations)
        ti.atomic_add(s.force_evaluations[w], iterations)

    @ti.func
    def window(self, w, i, begin, length, start, rounding, allowance, aim):
        """A particle through a window from ``start`` (s) on: how far it gets, to the end unless it is stuck
        or has made as many attempts as are allowed; the rounding error of that; its last verdict, steps,
        attempts and iterations."""
        s = self.own
        elapsed, carry = start, rounding
        steps, tries, iterations, verdict = ti.i64(0), ti.i64(0), ti.i64(0), ACCEPTED
        while elapsed < length and verdict != HOPELESS and tries < allowance:
            self.solve.keep(w, i)
            verdict = TRIED
            while verdict == TRIED:
                wanted = self.control.step(s, w, s.own_dt[w, i])
                last = wanted * (1.0 + LITTLE) >= length - elapsed
                dt = ti.select(last, length - elapsed, wanted)
                verdict, k = self.attempt(w, i, begin + elapsed, dt, aim)
                iterations += k
                tries += 1
                if verdict == ACCEPTED:
                    # The rounding error of the sum is carried along (W. Kahan 1965).
                    step = dt - carry
                    total = elapsed + step
                    carry = (total - elapsed) - step
                    elapsed = ti.select(last, length, total)
                    steps += 1
                    if ti.static(self.control.at_end):
                        went(s, w, i, self.solve.gone(w, i, ti.cast(dt, s.real)))
                    # That a step has been cut short says nothing about the next one.
                    s.own_dt[w, i] = ti.max(s.own_dt[w, i], ti.cast(ti.select(last, wanted, 0.0), s.real))
        return elapsed, carry, verdict, steps, tries, iterations

    @ti.func
    def attempt(self, w, i, t, dt, aim):
        """One step of this length; the verdict on it, and how many iterations it took."""
        s, solve = self.own, self.solve
        step, end = ti.cast(dt, s.real), t + dt
        v = solve.velocity(w, i, step, solve.jacobian(w, i, end))
        if not solve.bearable(w, i, v, step):
            v = s.velocity_before[w, i]
        solve.advance(w, i, v, step)
        k, verdict, iterating = 1, TRIED, 1
        while iterating > 0:
            # Before the force is written, so that what both depend on is computed once.
            jacobian = solve.jacobian(w, i, end)
            self.summed.alone(w, i, end)
            new = solve.velocity(w, i, step, jacobian)
            k += 1
            change, error = ti.cast(ti.math.inf, s.real), ti.cast(0.0, s.real)
            if solve.bearable(w, i, new, step):
                change = solve.phi(w) * step * (new - v).norm()
                v = new
                change += solve.advance(w, i, v, step)
                moved = solve.displacement(w, i, v, step).norm()
                # Nothing moves where nothing changes: 0/0 is no error.
                change = change / ti.select(change > 0.0, moved, 1.0)
                error = solve.error(w, i, step)
                error = error / ti.select(error > 0.0, self.control.scale(s, w, i, moved, step), 1.0)
            ratio, off = ti.cast(change, ti.f64), ti.cast(error, ti.f64)
            solved = self.control.solved(w, ratio)
            # Not below infinity: also true of NaN.
            if solved or k >= self.control.iterations or not (ratio < ti.math.inf):
                iterating = 0
                accepted = solved and self.control.accepts(w, off)
                wanted = dt
                # The longest step stays: a branch, as the next step then need not wait for the factor.
                if not (accepted and self.control.stays(w, dt, aim, ratio, k, off)):
                    wanted *= self.control.factor(w, aim, ratio, ti.cast(k, ti.f64), off)
                if accepted:
                    verdict = ACCEPTED
                else:
                    wanted = ti.min(wanted, SHORTER * dt)
                    verdict = ti.select(self.control.hopeless(s, w, dt), HOPELESS, TRIED)
                    solve.give_up(w, i)
                s.own_dt[w, i] = ti.cast(wanted, s.real)
        return verdict, k - 1


class EndStretch(Phase):
    """The windows are done, or a part of them, or one that is cut; or the first particle to be stuck is
    found."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.control = context.s, context.control

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.events[w] = 0
        if s.underway[w] > 0:
            s.reached[w] = own_time(s, self.control, w, self.slowest(w))
            # Whoever asks for more may look first.
            s.step_limit[w] = s.steps[w]
        elif s.stuck[w] > 0.0:
            self.accuse(w)
        elif s.cut[w] > 0.0:
            s.time[w] = beginning(s, self.control, w, s.windows[w]) + s.cut[w]
            s.status[w], s.cut[w] = WorldStatus.ENDED, 0.0
        else:
            s.windows[w] += s.stretch_windows[w]
            before, s.time[w] = s.time[w], beginning(s, self.control, w, s.windows[w])
            s.dt[w] = (s.time[w] - before) / s.stretch_windows[w]
            s.steps[w] += ti.cast(s.stretch_windows[w], ti.i64)

    @ti.func
    def slowest(self, w):
        """The particle that has come least far."""
        s = self.s
        least = 0
        for i in range(s.count[w]):
            if own_time(s, self.control, w, i) < own_time(s, self.control, w, least):
                least = i
        return least

    @ti.func
    def accuse(self, w):
        """The particle that got stuck first, and when."""
        self.stop(w, self.slowest(w), WorldStatus.STEP_TOO_SHORT)
        self.s.ask(w, self.s.time[w])

    @ti.func
    def stop(self, w, i, fault):
        """The world, where a particle has been stopped by this; windows that all have passed are good."""
        s = self.s
        s.steps[w] += ti.cast(s.own_window[w, i] - s.windows[w], ti.i64)
        s.time[w], s.cut[w] = own_time(s, self.control, w, i), s.own_elapsed[w, i]
        s.failed[w], s.failing_particle[w] = fault, s.id[w, i]
