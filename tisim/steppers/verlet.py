"""Velocity Verlet, then operators, then pair events: the order of a step.

Forces are kicked half before and half after the drift (L. Verlet 1967; W. C. Swope et al. 1982). A scene
without forces drifts in straight lines, r(t + dt) = r(t) + dt v (Z04 section 6c), and has no kick at all.
"""

from tisim._taichi import ti
from tisim.program import Item, PerParticle, Phase
from tisim.state import ENDED, LOST, NOT_FINITE
from tisim.steppers.stepper import Parts, Stepper


class Verlet(Stepper):
    """Explicit stepper with step control. Second order in dt for forces that depend on position only."""

    def step(self, parts: Parts) -> tuple[Item, ...]:
        s, near, forced = parts.s, parts.near, parts.forced
        drift = Move(s, parts.domain, parts.operators, forced, parts.turning)
        kick = (Kick(s, parts.turning),) if forced else ()
        start = (Clock(s, parts.control, near), drift, Advance(s, near))
        return (*start, *parts.lists, *parts.remember, *parts.forces, *kick)


@ti.func
def half_kick(s, w, i, turning: ti.template()):  # type: ignore[valid-type]
    """v += dt/2 F/m; spin += dt/2 M/I with I = 2/5 m R^2, a solid sphere's (Z16 7.8)."""
    half = 0.5 * ti.cast(s.dt[w], s.real)
    s.velocity[w, i] += half / s.mass[w, i] * s.force[w, i]
    if ti.static(turning):
        s.spin[w, i] += half / (0.4 * s.mass[w, i] * s.radius[w, i] ** 2) * s.torque[w, i]


class Clock(Phase):
    """Choose the step; the last one ends exactly on time."""

    def __init__(self, s, controller, near) -> None:
        self.s, self.controller, self.near, self.lists = s, controller, near, near is not None

    @ti.func
    def run(self, w, _k):
        s = self.s
        horizon = ti.cast(0.0, s.real)
        if ti.static(self.lists):
            horizon = self.near.sure(w)
        dt = self.controller.next(s, w, horizon)
        left = s.end[w] - s.time[w]
        # A remainder as small as rounding leaves is not worth a step of its own.
        if dt * (1.0 + 1e-6) >= left:
            dt = left
        s.dt[w] = dt
        s.approach_time[w] = ti.math.inf
        s.fastest[w] = 0.0
        s.steps[w] += 1
        s.particle_steps[w] += s.count[w]
        for k in ti.static(range(3)):
            s.stride[w, k] = 0.0
        s.events[w] = 0


class Move(PerParticle):
    """Kick, drift, wrap, and what operators do to single particles."""

    def __init__(self, s, domain, operators, forced: bool, turning: bool) -> None:
        super().__init__(s)
        self.domain, self.operators, self.forced, self.turning = domain, operators, forced, turning

    @ti.func
    def run(self, w, i):
        s = self.s
        dt = ti.cast(s.dt[w], s.real)
        if ti.static(self.forced):
            half_kick(s, w, i, self.turning)
        before, size = s.position[w, i], s.radius[w, i]
        s.position[w, i] = before + dt * s.velocity[w, i]
        for operator in ti.static(self.operators):
            operator.particle(s, w, i, dt)
        # Operators may move particles too, and a surface that grows is one that moves.
        stride = ti.abs(ti.cast(s.position[w, i] - before, ti.f64) - s.axes(s.frame, w) * s.dt[w])
        if ti.static(len(self.operators) > 0):
            stride += ti.abs(ti.cast(s.radius[w, i] - size, ti.f64))
        # Not below infinity: also true of NaN.
        if not (stride.sum() < ti.math.inf):
            s.fail(w, NOT_FINITE, i)
        elif self.domain.lost(w, s.position[w, i]):
            s.fail(w, LOST, i)
        else:
            for k in ti.static(range(3)):
                if stride[k] > s.stride[w, k]:
                    ti.atomic_max(s.stride[w, k], stride[k])
            s.position[w, i] = self.domain.wrap(w, s.position[w, i])


class Kick(PerParticle):
    """The second half of the kick."""

    def __init__(self, s, turning: bool) -> None:
        super().__init__(s)
        self.turning = turning

    @ti.func
    def run(self, w, i):
        half_kick(self.s, w, i, self.turning)


class Advance(Phase):
    """Time moves on, with the rounding error carried along (W. Kahan 1965)."""

    def __init__(self, s, near) -> None:
        self.s, self.near, self.lists = s, near, near is not None

    @ti.func
    def run(self, w, _k):
        s = self.s
        last = s.dt[w] == s.end[w] - s.time[w]
        step = s.dt[w] - s.time_carry[w]
        time = s.time[w] + step
        s.time_carry[w] = (time - s.time[w]) - step
        s.time[w] = time
        if ti.static(self.lists):
            self.near.moved(w)
        if last:
            s.time[w], s.time_carry[w] = s.end[w], 0.0


class Finish(Phase):
    """A world that has reached its end stops."""

    def __init__(self, s) -> None:
        self.s = s

    @ti.func
    def run(self, w, _k):
        if self.s.time[w] >= self.s.end[w]:
            ti.atomic_max(self.s.status[w], ENDED)
