"""Common parts of implicit steppers: attempts at a step, until one is accepted or none can succeed."""

from tisim.backend.taichi import ti
from tisim.program.phases import Item, PerParticle, Phase, Repeat
from tisim.state.fields import WorldField
from tisim.state.status import WorldStatus
from tisim.steppers.common import ReportDisplacement, SavedState, note_displacement
from tisim.steppers.context import StepContext
from tisim.steppers.step_control import note_speed

RETRY, ACCEPTED, HOPELESS = range(3)
"""The verdict on an attempt: try again with a shorter step, accepted, or given up."""

ATTEMPTS = (
    *(WorldField(name, "counter") for name in ("rejections", "solver_iterations", "force_evaluations")),
    WorldField("time_before", "real", "s"),
    WorldField("next_dt", "real", "s"),
    WorldField("attempting", "integer"),
    WorldField("verdict", "integer"),
    WorldField("outrun", "integer"),
)
"""World fields of all implicit steppers."""

SHORTER, FAR_SHORTER = 0.8, 0.5
"""Largest length of a second attempt, over the length of the first; the latter after one far astray."""


class Begin(Phase):
    """This phase begins a step."""

    def __init__(self, context: StepContext) -> None:
        self.s = context.s

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.time_before[w] = s.time[w]
        s.attempting[w], s.outrun[w] = 1, 0
        s.approach_time[w] = ti.math.inf
        s.fastest[w] = 0.0
        s.events[w] = 0
        s.steps[w] += 1
        s.particle_steps[w] += s.count[w]
        for k in ti.static(range(3)):
            s.displacement[w, k] = 0.0


class ReportTrial(ReportDisplacement):
    """This phase reports the displacements of an attempt to the neighbour lists, and records whether solid
    particles may have passed through each other."""

    @ti.func
    def run(self, w, _k):
        s = self.s
        if self.lists.tried(w):
            s.outrun[w] = 1
        for k in ti.static(range(3)):
            s.displacement[w, k] = 0.0


def report_trial(context: StepContext) -> tuple[Phase, ...]:
    """Return the phase that reports displacements of an attempt to the neighbour lists, if there are any."""
    return (ReportTrial(context),) if context.neighbour_lists else ()


class SaveState(PerParticle):
    """This phase stores the state at the beginning of the step, and finds the largest speed if it limits the
    step."""

    def __init__(self, context: StepContext, saved_state: SavedState) -> None:
        super().__init__(saved_state.s)
        self.saved_state, self.control = saved_state, context.control

    @ti.func
    def run(self, w, i):
        self.saved_state.save(w, i)
        if self.control.stride(w) > 0.0:
            note_speed(self.s, w, i)


class StepAttempt(Repeat):
    """This repeat makes attempts at a step, until one is accepted or none can succeed."""

    def __init__(self, context: StepContext, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.s = context.s

    @ti.func
    def pending(self, w):
        return self.s.attempting[w]


@ti.func
def length(s, control: ti.template(), w):  # type: ignore[valid-type]
    """Return the length (s, f64) of the next attempt; the last step ends exactly at the end of the run."""
    dt = control.step(s, w, s.next_dt[w], s.fastest[w])
    remaining = s.end[w] - s.time_before[w]
    # A remainder at the level of rounding errors gets no step of its own.
    if dt * (1.0 + 1e-6) >= remaining:
        dt = remaining
    return dt


@ti.func
def relative(change, moved):
    """Return a change or an error over the displacement. If nothing changes, nothing moves: 0/0 is no
    error."""
    return change / ti.select(change > 0.0, moved, 1.0)


@ti.func
def report_failure(s, w):
    """Record the particle whose last iterate changed most, and request a search for the force on it that
    fails (see failure_attribution.py)."""
    worst, most = 0, s.iterate_change[w, 0]
    for i in range(s.count[w]):
        if s.iterate_change[w, i] > most:
            worst, most = i, s.iterate_change[w, i]
    s.failing_particle[w] = s.id[w, worst]
    s.ask(w, s.time[w])


@ti.func
def verdict_on(control: ti.template(), s, w, dt, accepted):  # type: ignore[valid-type]
    """Return the verdict on an attempt of this length (s); after a rejected one of the shortest length there
    is no hope."""
    verdict = ACCEPTED
    if not accepted:
        verdict = ti.select(control.hopeless(s, w, dt), HOPELESS, RETRY)
    return verdict


@ti.func
def conclude(control: ti.template(), s, w, accepted, factor, most):  # type: ignore[valid-type]
    """Set the verdict on the attempt of a world, and the length of the next attempt (s).

    An attempt in which solid particles may have passed through each other is not accepted.

    factor : the proposed ratio of the lengths. most : the largest ratio after a rejected attempt, which would
        fail again in the same way with the same length.
    """
    passing = s.outrun[w] > 0
    verdict = verdict_on(control, s, w, s.dt[w], accepted and not passing)
    if verdict == HOPELESS and not passing:
        report_failure(s, w)
    s.verdict[w] = verdict
    s.next_dt[w] = s.dt[w] * ti.select(
        verdict == ACCEPTED, factor, ti.min(factor, ti.select(passing, FAR_SHORTER, most))
    )


class RestoreState(PerParticle):
    """After a failed attempt this phase restores the state at the beginning of the step.

    A hopeless attempt is left as it is, so that the force that failed can be found (see
    failure_attribution.py).
    """

    conditional = True

    def __init__(self, saved_state: SavedState) -> None:
        super().__init__(saved_state.s)
        self.saved_state = saved_state

    @ti.func
    def when(self, w):
        return ti.select(self.s.verdict[w] == RETRY, 1, 0)

    @ti.func
    def run(self, w, i):
        s = self.s
        here, there = s.position[w, i], s.position_before[w, i]
        back = self.saved_state.domain.nearest(w, here, there, s.time[w])
        note_displacement(s, w, ti.cast(back, ti.f64))
        self.saved_state.restore(w, i)


class Decide(Phase):
    """This phase decides whether there is another attempt."""

    def __init__(self, context: StepContext) -> None:
        self.s = context.s

    @ti.func
    def run(self, w, _k):
        s = self.s
        if s.verdict[w] != ACCEPTED:
            s.rejections[w] += 1
            s.time[w] = s.time_before[w]
        if s.verdict[w] == HOPELESS:
            s.failed[w] = ti.select(s.outrun[w] > 0, WorldStatus.OUTRUN, WorldStatus.STEP_TOO_SHORT)
        s.outrun[w] = 0
        s.attempting[w] = ti.select(s.verdict[w] == RETRY, 1, 0)
