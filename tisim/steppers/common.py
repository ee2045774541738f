"""Phases and fields that several steppers have in common, such as the state before a step."""

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics.ieee import compensated_sum, finite, rounded_vector
from tisim.program.phases import PerParticle, Phase
from tisim.state.fields import Field
from tisim.state.status import WorldStatus
from tisim.steppers.context import StepContext

POSITION_ROUNDING = Field("position_rounding", "m", 3, "keep", scratch=True)
"""Accumulated rounding error of a particle's displacements; in single precision only."""


def rounding_fields() -> tuple[Field, ...]:
    """Return the field of the rounding errors of displacements, in single precision only."""
    return (POSITION_ROUNDING,) if runtime.precision() == "f32" else ()


@ti.func
def displaced(s, w, i, r, path):
    """Return the place (m) reached from r by a displacement ``path`` (m). In single precision the sum is
    compensated (W. Kahan 1965): otherwise slow particles would lose a part of each step, always in the same
    direction."""
    place = r + path
    if ti.static(POSITION_ROUNDING in s.fields):
        whole = path + s.position_rounding[w, i]
        # The remainder is far below 1 m.
        place = rounded_vector(r + whole, s.position_rounding[w, i][0])
        s.position_rounding[w, i] = whole - rounded_vector(place - r, s.position_rounding[w, i][0])
    return place


@ti.func
def note_displacement(s, w, moved):
    """Record for the pair lists that a particle has moved by ``moved`` (m, f64) relative to the world's
    frame."""
    for k in ti.static(range(3)):
        far = ti.abs(moved[k])
        if far > s.displacement[w, k]:
            ti.atomic_max(s.displacement[w, k], far)


@ti.func
def apply_displacement(s, domain: ti.template(), w, i, r, moved, grown, t):  # type: ignore[valid-type]
    """Put a particle at r (m), wrapped into the domain at time t (s). It has moved by ``moved`` (m, f64)
    relative to the frame, and its radius has grown by ``grown`` (m, f64); for pair lists a growing surface is
    a moving one."""
    change = ti.abs(moved) + ti.abs(grown)
    if not finite(change.sum()):
        s.fail(w, WorldStatus.NOT_FINITE, i)
    elif domain.lost(w, r):
        s.fail(w, WorldStatus.POSITION_LOST, i)
    else:
        note_displacement(s, w, change)
        domain.put(s, w, i, r, t)


@ti.func
def drift(s, domain: ti.template(), w, r):  # type: ignore[valid-type]
    """Return the velocity (m/s, f64) of the frame at r, including the flow of a sheared domain."""
    return s.axes(s.frame, w) + ti.cast(domain.streaming(w, r), ti.f64)


class BeginStep(Phase):
    """This phase chooses the step; the last step ends exactly at the end of the run."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.control = context.s, context.control
        self.lists, self.listed = context.neighbour_lists, context.neighbour_lists is not None

    @ti.func
    def run(self, w, _k):
        s = self.s
        horizon = ti.cast(0.0, s.real)
        if ti.static(self.listed):
            horizon = self.lists.sure(w)
        dt = self.control.next(s, w, horizon)
        remaining = s.end[w] - s.time[w]
        # A remainder at the level of rounding errors gets no step of its own.
        if dt * (1.0 + 1e-6) >= remaining:
            dt = remaining
        s.dt[w] = dt
        s.approach_time[w] = ti.math.inf
        s.fastest[w] = 0.0
        s.steps[w] += 1
        s.particle_steps[w] += s.count[w]
        for k in ti.static(range(3)):
            s.displacement[w, k] = 0.0
        s.events[w] = 0


class MoveParticles(PerParticle):
    """This is the base of a phase that moves each particle once, from the beginning to the end of a step.

    A subclass defines ``move``. After it, operators change the particle, and it is put into the domain. The
    distance that it has moved and the growth of its radius are recorded for the pair lists. During the phase,
    the time of the world is the beginning of the step.
    """

    def __init__(self, context: StepContext) -> None:
        super().__init__(context.s)
        self.domain, self.operators = context.domain, context.operators

    @ti.func
    def move(self, s, w, i, dt):
        """Change position and velocity of particle i alone over dt (s)."""

    @ti.func
    def run(self, w, i):
        s = self.s
        dt, end = ti.cast(s.dt[w], s.real), s.time[w] + s.dt[w]
        before, size = s.position[w, i], s.radius[w, i]
        self.move(s, w, i, dt)
        for operator in ti.static(self.operators):
            operator.particle(s, w, i, end, dt)
        path, grown = s.position[w, i] - before, ti.cast(s.radius[w, i] - size, ti.f64)
        moved = ti.cast(path, ti.f64) - drift(s, self.domain, w, before) * s.dt[w]
        apply_displacement(s, self.domain, w, i, s.position[w, i], moved, grown, end)


class FirstStep(Phase):
    """This phase sets the length of the first step, if all steps have the same length."""

    def __init__(self, s, control) -> None:
        self.s, self.control = s, control

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.step_ahead[w] = ti.min(self.control.next(s, w, ti.cast(0.0, s.real)), s.end[w] - s.time[w])


@ti.func
def advance_clock(s, w):
    """Advance the time by dt."""
    last = s.dt[w] == s.end[w] - s.time[w]
    s.time[w], s.time_carry[w] = compensated_sum(s.time[w], s.dt[w], s.time_carry[w], s.count[w])
    if last:
        s.time[w], s.time_carry[w] = s.end[w], 0.0


class ReportDisplacement(Phase):
    """This phase reports the displacements of particles to the neighbour lists."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.lists = context.s, context.neighbour_lists

    @ti.func
    def run(self, w, _k):
        self.lists.moved(w)
        for k in ti.static(range(3)):
            self.s.displacement[w, k] = 0.0


class ApplyOperators(PerParticle):
    """This phase lets operators change single particles after the step, which began at ``time_before``."""

    def __init__(self, context: StepContext) -> None:
        super().__init__(context.s)
        self.domain, self.operators = context.domain, context.operators

    @ti.func
    def run(self, w, i):
        s = self.s
        before, size = s.position[w, i], s.radius[w, i]
        end = s.time_before[w] + s.dt[w]
        for operator in ti.static(self.operators):
            operator.particle(s, w, i, end, ti.cast(s.dt[w], s.real))
        after = s.position[w, i]
        grown = ti.cast(s.radius[w, i] - size, ti.f64)
        apply_displacement(s, self.domain, w, i, after, ti.cast(after - before, ti.f64), grown, end)


class AdvanceClock(Phase):
    """This phase ends the step: time, which was the time of a trial state, advances from the beginning of the
    step."""

    def __init__(self, context: StepContext) -> None:
        self.s = context.s

    @ti.func
    def run(self, w, _k):
        self.s.time[w] = self.s.time_before[w]
        advance_clock(self.s, w)


class EndStep(Phase):
    """This phase lets effects update their state variables of the world, given the forces at the end of the
    step."""

    def __init__(self, s, effects) -> None:
        self.s, self.effects = s, effects

    @ti.func
    def run(self, w, _k):
        for effect in ti.static(self.effects):
            effect.end_step(self.s, w)


class FinishStep(Phase):
    """This phase stops a world that has reached the end of the run."""

    def __init__(self, s) -> None:
        self.s = s

    @ti.func
    def run(self, w, _k):
        if self.s.time[w] >= self.s.end[w]:
            ti.atomic_max(self.s.status[w], WorldStatus.ENDED)


def report_displacement(context: StepContext) -> tuple[Phase, ...]:
    """Return the phase that reports displacements to the neighbour lists, if there are any."""
    return (ReportDisplacement(context),) if context.neighbour_lists else ()


def apply_operators(context: StepContext) -> tuple[Phase, ...]:
    """Return the phases that let operators act on single particles, if there are operators."""
    return (ApplyOperators(context), *report_displacement(context)) if context.operators else ()


FORCE_BEFORE = Field("force_before", "N", 3, "keep", scratch=True)
TORQUE_BEFORE = Field("torque_before", "N m", 3, "keep", scratch=True)
STATE_BEFORE = (
    Field("position_before", "m", 3, "keep", scratch=True),
    Field("velocity_before", "m/s", 3, "keep", scratch=True),
    FORCE_BEFORE,
)
CHANGE = Field("iterate_change", "m", 1, "keep", scratch=True)
"""Difference of the last two iterates of a particle."""
TURNING_BEFORE = (Field("spin_before", "rad/s", 3, "keep", scratch=True), TORQUE_BEFORE)


def saved_fields(turning: bool) -> tuple[Field, ...]:
    """Return the fields of the saved state, in a scene with or without torques."""
    return (*STATE_BEFORE, *(TURNING_BEFORE if turning else ()))


@ti.data_oriented
class SavedState:
    """The state of particles at the beginning of a step, to be restored."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.domain, self.turning = context.s, context.domain, context.turning

    @ti.func
    def save(self, w, i):
        """Save the state of a particle at the beginning of a step."""
        s = self.s
        s.position_before[w, i], s.velocity_before[w, i] = s.position[w, i], s.velocity[w, i]
        s.force_before[w, i] = s.force[w, i]
        if ti.static(self.turning):
            s.spin_before[w, i], s.torque_before[w, i] = s.spin[w, i], s.torque[w, i]

    @ti.func
    def restore(self, w, i):
        """Put a particle back to the beginning of the step."""
        s = self.s
        s.position[w, i], s.velocity[w, i] = s.position_before[w, i], s.velocity_before[w, i]
        s.force[w, i] = s.force_before[w, i]
        if ti.static(self.turning):
            s.spin[w, i], s.torque[w, i] = s.spin_before[w, i], s.torque_before[w, i]

    @ti.func
    def sound(self, w, r):
        """Return whether the place r (m) is finite and can be represented."""
        return finite(r.norm_sqr()) and not self.domain.lost(w, r)
