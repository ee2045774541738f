"""Velocity Verlet, followed by operators and pair events: the order of a step.

Forces act in half a kick before and half a kick after the drift (L. Verlet 1967; W. C. Swope et al. 1982). In
a scene without forces, particles drift in straight lines, r(t + dt) = r(t) + dt v (Z04 section 6c), without
kicks.
"""

from collections.abc import Sequence
from typing import ClassVar, Self

from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import Effect, Force, PairEvent, SceneParts
from tisim.errors import must
from tisim.program.phases import PerParticle, Phase
from tisim.state.fields import Field
from tisim.steppers.base import Stepper
from tisim.steppers.common import (
    FORCE_BEFORE,
    BeginStep,
    advance_clock,
    apply_displacement,
    displaced,
    drift,
    rounding_fields,
)
from tisim.steppers.constraints import advance_bodies, kick_bodies, offering, put_held, steer_held
from tisim.steppers.context import Step, StepContext
from tisim.steppers.step_control import ApproachTime, Controller, FixedStep
from tisim.steppers.step_guard import STEP_EXCESS, STRAINED, check_step, guard_fields


class Verlet(Stepper):
    """Velocity Verlet advances time explicitly: half a kick by the forces, a drift, half a kick.

        v += dt/2 F/m,    r += dt v,    v += dt/2 F'/m

    It is of second order in dt for forces that depend on position only. In a scene without forces, particles
    drift in straight lines, without kicks. Operators and pair events follow the drift. A step above 0.45 of
    the critical step, 2/omega of the stiffest motion, stops the world.

    Source: L. Verlet, Phys. Rev. 159 (1967) 98; W. C. Swope et al., J. Chem. Phys. 76 (1982) 637.
    """

    control: Controller = option("step control", ApproachTime())

    world_fields: ClassVar = (STEP_EXCESS,)
    follows_shear: ClassVar = True
    follows_constraints: ClassVar = True

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        # Kicks use velocities at other times than the forces, which is of first order for velocity-dependent
        # forces.
        if any(effect.offers("velocity_jacobian") for effect in effects if isinstance(effect, Force)):
            return ()
        events = any(isinstance(effect, PairEvent) for effect in effects)
        return (cls(control=FixedStep(dt=dt)), *((cls(),) if events else ()))

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        for effect in scene.effects:
            rule = f"one that turns velocities, such as boris or collocation, with effects.{effect.label}"
            must(not effect.gyrates(scene.effects), "stepper", rule, self.kind())

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        return (*guard_fields(effects), *rounding_fields())

    def step(self, context: StepContext) -> Step:
        kick = (*kick_bodies(context), Kick(context)) if context.forced else ()
        drift = (BeginStep(context), *advance_bodies(context), Move(context), Advance(context))
        return Step((*drift, *context.update_lists, *context.sum_forces, *kick))


@ti.func
def half_kick(s, w, i, turning: ti.template()):  # type: ignore[valid-type]
    """Kick velocity and spin by half a step: v += dt/2 F/m; spin += dt/2 M/I with I = 2/5 m R^2 for a solid
    sphere (Z16 7.8)."""
    half = 0.5 * ti.cast(s.dt[w], s.real)
    s.velocity[w, i] = s.velocity[w, i] + half / s.mass[w, i] * s.force[w, i]
    if ti.static(turning):
        # For grains of nanometres, m R^2 underflows in f32.
        turn = half / (0.4 * s.mass[w, i] * s.radius[w, i]) * (s.torque[w, i] / s.radius[w, i])
        s.spin[w, i] = s.spin[w, i] + turn


class Move(PerParticle):
    """This phase kicks, drifts and wraps particles, or places them as constraints prescribe, and lets
    operators change single particles."""

    def __init__(self, context: StepContext) -> None:
        super().__init__(context.s)
        self.domain, self.operators = context.domain, context.operators
        self.forced, self.turning = context.forced, context.turning
        self.constraints, self.guarded = context.constraints, FORCE_BEFORE in context.s.fields
        self.turning_shapes = offering(context.constraints, "swept")

    @ti.func
    def run(self, w, i):
        s = self.s
        dt = ti.cast(s.dt[w], s.real)
        before, size, end = s.position[w, i], s.radius[w, i], s.time[w] + s.dt[w]
        held = put_held(s, self.domain, self.constraints, w, i, end, dt)
        if held == 0:
            if ti.static(self.guarded):
                s.force_before[w, i] = s.force[w, i]
                if ti.static(self.turning):
                    s.torque_before[w, i] = s.torque[w, i]
            if ti.static(self.forced):
                half_kick(s, w, i, self.turning)
            s.position[w, i] = displaced(s, w, i, before, dt * s.velocity[w, i])
        for operator in ti.static(self.operators):
            operator.particle(s, w, i, end, dt)
        after, grown = s.position[w, i], ti.cast(s.radius[w, i] - size, ti.f64)
        for constraint in ti.static(self.turning_shapes):
            if constraint.holds(s, w, i):
                grown = ti.abs(grown) + ti.cast(constraint.swept(s, w, i), ti.f64)
        path = after - before
        if ti.static(len(self.constraints) > 0):
            # A held particle may have been put through a periodic face already.
            path = ti.select(held > 0, self.domain.nearest(w, before, after, end), path)
            if ti.static(not self.forced):
                # No kick follows, which would otherwise set their velocities.
                steer_held(s, self.constraints, w, i, end)
        moved = ti.cast(path, ti.f64) - drift(s, self.domain, w, before) * s.dt[w]
        apply_displacement(s, self.domain, w, i, after, moved, grown, end)


class Kick(PerParticle):
    """This phase is the second half of the kick, after the drift."""

    local = True

    def __init__(self, context: StepContext) -> None:
        super().__init__(context.s)
        self.turning, self.constraints = context.turning, context.constraints
        self.guarded, self.patient = FORCE_BEFORE in context.s.fields, STRAINED in context.s.fields

    @ti.func
    def run(self, w, i):
        if steer_held(self.s, self.constraints, w, i, self.s.time[w]) == 0:
            if ti.static(self.guarded):
                torque = 0.0 * self.s.force[w, i]
                if ti.static(self.turning):
                    torque = self.s.torque[w, i]
                dt = ti.cast(self.s.dt[w], self.s.real)
                path = dt * self.s.velocity[w, i].norm()
                check_step(self.s, w, i, dt, path, self.s.force[w, i], torque, self.turning, self.patient)
            half_kick(self.s, w, i, self.turning)


class Advance(Phase):
    """This phase advances time, and reports displacements to the pair lists."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.lists = context.s, context.neighbour_lists
        self.listed = context.neighbour_lists is not None

    @ti.func
    def run(self, w, _k):
        advance_clock(self.s, w)
        if ti.static(self.listed):
            self.lists.moved(w)
