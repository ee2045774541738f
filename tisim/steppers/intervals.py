"""Synchronisation intervals: where particles that do not feel each other meet.

Each takes its own steps, and all meet at every multiple of the longest step. From one such time to the next
is an interval, which counts as one step of the world. A launch takes particles through some of them, and may
end anywhere: where each particle is on its way is in its own clock.
"""

from tisim.backend.taichi import ti
from tisim.program.phases import Phase
from tisim.state.fields import Field
from tisim.state.status import WorldStatus
from tisim.steppers.context import StepContext

LAUNCH_ATTEMPTS = 2**20
"""A launch has at most so many intervals, and so many attempts at a step, of all particles together: about a
second."""
LEAST_INTERVALS = 64
"""A launch may take every particle through so many intervals or attempts, however many particles there
are."""
LITTLE = 1e-6
"""A remainder of an interval or a step of this part of its length is worth no step of its own: rounding
leaves it."""
OWN_CLOCK = tuple(
    Field(name, unit, 1, "keep", scratch=True, double=True)
    for name, unit in (("own_interval", ""), ("own_elapsed", "s"), ("own_carry", "s"))
)
"""These fields say where a particle is on its way: the number of its interval, how far it is in it, and the
rounding error of that."""
INTERVAL_QUANTITIES = ("intervals", "launch_intervals")
"""These are the intervals of a world that are over, and those that this launch is to take it through."""
INTERVAL_FLAGS = ("halted", "attempt_limit")
"""These say whether a particle of a world cannot go on, and how many attempts each may make in this
launch."""


class BeginIntervals(Phase):
    """This phase sets the intervals of a launch: up to the end, to the next time at which somebody looks, or
    to as many as are asked for; and the attempts that a particle may make. What an earlier launch has left is
    done first.

    The world's time is counted in intervals, so that it does not drift.
    """

    def __init__(self, context: StepContext) -> None:
        self.s, self.control = context.s, context.control
        self.most = max(LEAST_INTERVALS, LAUNCH_ATTEMPTS // (self.s.worlds * self.s.capacity))

    @ti.func
    def run(self, w, _k):
        s = self.s
        going = s.underway[w]
        if going == 0:
            going = s.count[w]
            interval = ti.cast(self.control.longest(w), ti.f64)
            until = ti.min(s.pause_time[w], s.end[w])
            remaining = ti.ceil(until / interval - LITTLE) - s.intervals[w]
            allowed = ti.cast(ti.min(s.step_limit[w] - s.steps[w], self.most), ti.f64)
            s.launch_intervals[w], s.halted[w] = ti.max(1.0, ti.min(remaining, allowed)), 0
        s.attempt_limit[w] = ti.max(LEAST_INTERVALS, LAUNCH_ATTEMPTS // (s.worlds * ti.max(1, going)))
        s.underway[w] = 0


@ti.func
def beginning(s, control: ti.template(), w, interval):  # type: ignore[valid-type]
    """Return the time (s, f64) at which an interval begins: none after the end, and the first of all at 0."""
    length = ti.cast(control.longest(w), ti.f64)
    over = interval > 0.0 and (interval + LITTLE) * length >= s.end[w]
    return ti.select(over, s.end[w], interval * length)


@ti.func
def duration(s, control: ti.template(), w, interval, begin):  # type: ignore[valid-type]
    """Return the length (s, f64) of an interval that begins at ``begin`` (s); one that is cut ends there."""
    length = beginning(s, control, w, interval + 1.0) - begin
    return ti.select(s.cut[w] > 0.0, ti.min(length, s.cut[w]), length)


@ti.func
def own_time(s, control: ti.template(), w, i):  # type: ignore[valid-type]
    """Return the time (s, f64) that a particle has come to."""
    return beginning(s, control, w, s.own_interval[w, i]) + s.own_elapsed[w, i]


class EndIntervals(Phase):
    """This phase ends the intervals, or a part of them, or one that is cut; or it finds the first particle to
    be stuck."""

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
        elif s.halted[w] > 0:
            self.report_failure(w)
        elif s.cut[w] > 0.0:
            s.time[w] = beginning(s, self.control, w, s.intervals[w]) + s.cut[w]
            s.status[w], s.cut[w] = WorldStatus.ENDED, 0.0
        else:
            s.intervals[w] += s.launch_intervals[w]
            before, s.time[w] = s.time[w], beginning(s, self.control, w, s.intervals[w])
            s.dt[w] = (s.time[w] - before) / s.launch_intervals[w]
            s.steps[w] += ti.cast(s.launch_intervals[w], ti.i64)

    @ti.func
    def slowest(self, w):
        """Return the particle that has come least far."""
        s = self.s
        least = 0
        for i in range(s.count[w]):
            if own_time(s, self.control, w, i) < own_time(s, self.control, w, least):
                least = i
        return least

    @ti.func
    def report_failure(self, w):
        """Record the particle that got stuck first, and when."""
        self.stop(w, self.slowest(w), WorldStatus.STEP_TOO_SHORT)
        self.s.ask(w, self.s.time[w])

    @ti.func
    def stop(self, w, i, fault):
        """Stop the world where a particle has been stopped by this fault; intervals that all have passed are
        good."""
        s = self.s
        s.steps[w] += ti.cast(s.own_interval[w, i] - s.intervals[w], ti.i64)
        s.time[w], s.cut[w] = own_time(s, self.control, w, i), s.own_elapsed[w, i]
        s.failed[w], s.failing_particle[w] = fault, s.id[w, i]
