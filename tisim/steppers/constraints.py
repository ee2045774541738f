"""The phases in which constraints move the particles that they hold, and the functions that steppers call for
such a particle."""

from typing import Any

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint
from tisim.program.phases import PerParticle
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.steppers.context import StepContext

Constraints = tuple[Bound[Constraint], ...]


@ti.func
def put_held(s, domain: ti.template(), constraints: ti.template(), w, i, t, dt):  # type: ignore[valid-type]
    """Place a particle that a constraint holds at the end t (s) of a step of dt (s), with its velocity at the
    middle of the step; return whether a constraint holds it."""
    held = 0
    for constraint in ti.static(constraints):
        if constraint.holds(s, w, i):
            s.position[w, i] = domain.wrap(w, constraint.position(s, w, i, t), t)
            s.velocity[w, i], s.spin[w, i] = constraint.velocity_midway(s, w, i, t, dt)
            held = 1
    return held


@ti.func
def steer_held(s, constraints: ti.template(), w, i, t):  # type: ignore[valid-type]
    """Set the velocity of a particle that a constraint holds, at time t (s); return whether a constraint
    holds it."""
    held = 0
    for constraint in ti.static(constraints):
        if constraint.holds(s, w, i):
            s.velocity[w, i], s.spin[w, i] = constraint.velocity(s, w, i, t)
            held = 1
    return held


class OfConstraints(PerParticle):
    """This phase calls the constraints of each particle."""

    def __init__(self, s: State, constraints: Constraints) -> None:
        super().__init__(s)
        self.constraints = constraints


class LocateHeld(OfConstraints):
    """This phase tells constraints the memory slots of the particles that they hold."""

    @ti.func
    def run(self, w, i):
        for constraint in ti.static(self.constraints):
            if constraint.holds(self.s, w, i):
                constraint.locate(self.s, w, i)


class BeginConstraints(OfConstraints):
    """This phase lets constraints initialise their state variables of each particle; a particle that no
    constraint holds is its own body."""

    @ti.func
    def run(self, w, i):
        held = False
        for constraint in ti.static(self.constraints):
            if constraint.holds(self.s, w, i):
                constraint.begin(self.s, w, i)
                held = True
        if not held:
            self.s.body_mass[w, i] = self.s.mass[w, i]


class PutHeld(OfConstraints):
    """This phase places and moves particles as constraints prescribe."""

    @ti.func
    def run(self, w, i):
        t = self.s.time[w]
        put_held(self.s, self.s.domain, self.constraints, w, i, t, ti.cast(0.0, self.s.real))


class AdvanceBodies(OfConstraints):
    """This phase advances the bodies of constraints by a step."""

    @ti.func
    def run(self, w, i):
        for constraint in ti.static(self.constraints):
            if constraint.holds(self.s, w, i):
                constraint.advance(self.s, w, i, ti.cast(self.s.dt[w], self.s.real))


class KickBodies(OfConstraints):
    """This phase kicks the bodies of constraints by the forces at the end of the step."""

    @ti.func
    def run(self, w, i):
        for constraint in ti.static(self.constraints):
            if constraint.holds(self.s, w, i):
                constraint.kick(self.s, w, i, ti.cast(self.s.dt[w], self.s.real))


def offering(constraints: Constraints, hook: str) -> Constraints:
    """Return the constraints that define a hook which is empty in their contract."""
    return tuple(constraint for constraint in constraints if constraint.data.offers(hook))


def _asking(kind: Any, s: State, constraints: Constraints, hook: str) -> tuple[PerParticle, ...]:
    """Return a phase that calls the constraints that define the hook; none if no constraint does."""
    asked = offering(constraints, hook)
    return (kind(s, asked),) if asked else ()


def begin_constraints(s: State, constraints: Constraints) -> tuple[PerParticle, ...]:
    """Return the phases of constraints that come before the first step."""
    if not constraints:
        return ()
    locate = _asking(LocateHeld, s, constraints, "locate")
    return BeginConstraints(s, constraints), *locate, PutHeld(s, constraints)


def advance_bodies(context: StepContext) -> tuple[PerParticle, ...]:
    """Return the phases of constraints that precede the motion of particles."""
    s, constraints = context.s, context.constraints
    locate = _asking(LocateHeld, s, constraints, "locate")
    return *locate, *_asking(AdvanceBodies, s, constraints, "advance")


def kick_bodies(context: StepContext) -> tuple[PerParticle, ...]:
    """Return the phases of constraints that follow the sum of forces."""
    return _asking(KickBodies, context.s, context.constraints, "kick")
