"""Particles that do not feel each other: each takes its own implicit steps, many of them in one go.

There is no norm over all of them and nothing to wait for. The world moves in windows, and each particle
through a window in steps of its own.
"""

from tisim._taichi import ti
from tisim.program import PerParticle, Phase
from tisim.state import STUCK
from tisim.steppers.attempts import ACCEPTED, HOPELESS, SHORTER, TRIED
from tisim.steppers.phases import advance_clock


class Window(Phase):
    """The time that the world moves on by; the last window ends exactly on time."""

    def __init__(self, s, control, steps: int) -> None:
        self.s, self.control, self.steps = s, control, steps

    @ti.func
    def run(self, w, _k):
        s = self.s
        dt = self.steps * ti.cast(self.control.longest(w), ti.f64)
        left = s.end[w] - s.time[w]
        if dt * (1.0 + 1e-6) >= left:
            dt = left
        s.dt[w] = dt
        s.steps[w] += 1


class Alone(PerParticle):
    """A particle from the beginning of the window to its end."""

    long = True

    def __init__(self, parts, solve) -> None:
        super().__init__(parts.s)
        self.control, self.solve, self.summed = parts.control, solve, parts.summed

    @ti.func
    def run(self, w, i):
        s = self.s
        elapsed, carry, window = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64), s.dt[w]
        steps, tries, iterations = 0, 0, 0
        verdict = ACCEPTED
        while elapsed < window and verdict != HOPELESS:
            self.solve.keep(w, i)
            verdict = TRIED
            while verdict == TRIED:
                dt = self.control.step(w, s.own_dt[w, i])
                last = dt * (1.0 + 1e-6) >= window - elapsed
                if last:
                    dt = window - elapsed
                verdict, k = self.attempt(w, i, s.time[w] + elapsed, dt)
                iterations += k
                tries += 1
                if verdict == ACCEPTED:
                    # The rounding error of the sum is carried along (W. Kahan 1965).
                    step = dt - carry
                    total = elapsed + step
                    carry = (total - elapsed) - step
                    elapsed = ti.select(last, window, total)
                    steps += 1
        if verdict == HOPELESS:
            s.fail(w, STUCK, i)
            ti.atomic_min(s.blame[w], self.summed.largest(w, i))
        ti.atomic_add(s.particle_steps[w], steps)
        ti.atomic_add(s.rejections[w], tries - steps)
        ti.atomic_add(s.solver_iterations[w], iterations)
        ti.atomic_add(s.force_evaluations[w], iterations)

    @ti.func
    def attempt(self, w, i, t, dt):
        """One step of this length; the verdict on it, and how many iterations it took."""
        s, solve = self.s, self.solve
        step, end = ti.cast(dt, s.real), t + dt
        v = solve.velocity(w, i, step, end)
        if not solve.bearable(w, i, v, step):
            v = s.velocity_before[w, i]
        solve.advance(w, i, v, step)
        k, verdict, iterating = 1, TRIED, 1
        while iterating > 0:
            self.summed.alone(w, i, end)
            new = solve.velocity(w, i, step, end)
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
                error = error / ti.select(error > 0.0, self.control.scale(s, w, i, moved), 1.0)
            ratio, off = ti.cast(change, ti.f64), ti.cast(error, ti.f64)
            solved = self.control.solved(w, ratio)
            # Not below infinity: also true of NaN.
            if solved or k >= self.control.iterations or not (ratio < ti.math.inf):
                iterating = 0
                factor = self.control.factor(w, ratio, ti.cast(k, ti.f64), off)
                if solved and self.control.accepts(w, off):
                    verdict = ACCEPTED
                else:
                    factor = ti.min(factor, SHORTER)
                    verdict = ti.select(self.control.hopeless(w, dt), HOPELESS, TRIED)
                    solve.give_up(w, i)
                s.own_dt[w, i] = ti.cast(dt * factor, s.real)
        return verdict, k - 1


class EndWindow(Phase):
    """The window is done."""

    def __init__(self, s) -> None:
        self.s = s

    @ti.func
    def run(self, w, _k):
        advance_clock(self.s, w)
