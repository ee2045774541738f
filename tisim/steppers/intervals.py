"""Synchronisation intervals, at the ends of which particles that do not interact meet.

Each particle takes its own steps, and all meet at every multiple of the longest step. The time between two
meetings is an interval, which counts as one step of the world. A launch takes particles through some
intervals and may end anywhere: the progress of each particle is in its own clock.
"""

from tisim.backend.taichi import ti
from tisim.program.phases import Phase
from tisim.state.fields import Field, WorldField
from tisim.state.status import WorldStatus
from tisim.steppers.context import StepContext

LAUNCH_ATTEMPTS = 2**20
"""Largest number of intervals in a launch, and of attempts at a step, of all particles together: about one
second."""
LEAST_INTERVALS = 64
"""Number of intervals or attempts that a launch always allows each particle, however many particles there
are."""
LITTLE = 1e-6
"""A remainder of an interval or a step below this part of its length is due to rounding, and gets no step of
its own."""
OWN_CLOCK = tuple(
    Field(name, unit, 1, "keep", scratch=True, double=True)
    for name, unit in (("own_interval", ""), ("own_elapsed", "s"), ("own_carry", "s"))
)
"""The progress of a particle: the number of its interval, the time elapsed in it, and the rounding error of
that time."""
INTERVALS = (
    WorldField("intervals", "real"),
    WorldField("launch_intervals", "real"),
    WorldField("halted", "integer"),
    WorldField("attempt_limit", "integer"),
)
"""Completed intervals of a world, intervals of the present launch, whether a particle of the world cannot go
on, and the number of attempts allowed to each in this launch."""


class BeginIntervals(Phase):
    """This phase sets the number of intervals of a launch, up to the end of the run, the next pause, or the
    step limit; and the number of attempts allowed to a particle. Intervals left over from an earlier launch
    are completed first.

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
    """Return the time (s, f64) at which an interval begins; the first begins at 0, and none after the end of
    the run."""
    length = ti.cast(control.longest(w), ti.f64)
    over = interval > 0.0 and (interval + LITTLE) * length >= s.end[w]
    return ti.select(over, s.end[w], interval * length)


@ti.func
def duration(s, control: ti.template(), w, interval, begin):  # type: ignore[valid-type]
    """Return the length (s, f64) of an interval that begins at ``begin`` (s), or its length up to the cut
    after a failure."""
    length = beginning(s, control, w, interval + 1.0) - begin
    return ti.select(s.cut[w] > 0.0, ti.min(length, s.cut[w]), length)


@ti.func
def own_time(s, control: ti.template(), w, i):  # type: ignore[valid-type]
    """Return the time (s, f64) that a particle has reached."""
    return beginning(s, control, w, s.own_interval[w, i]) + s.own_elapsed[w, i]


class EndIntervals(Phase):
    """This phase ends the intervals of a launch, a part of them, or an interval cut after a failure; or it
    finds the first particle that is stuck."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.control = context.s, context.control

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.events[w] = 0
        if s.underway[w] > 0:
            s.reached[w] = own_time(s, self.control, w, self.slowest(w))
            # The caller may inspect the world before it asks for more.
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
        """Return the particle whose time is least."""
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
        """Stop the world at the time at which this fault stopped a particle; intervals that all particles
        have completed are counted."""
        s = self.s
        s.steps[w] += ti.cast(s.own_interval[w, i] - s.intervals[w], ti.i64)
        s.time[w], s.cut[w] = own_time(s, self.control, w, i), s.own_elapsed[w, i]
        s.failed[w], s.failing_particle[w] = fault, s.id[w, i]
