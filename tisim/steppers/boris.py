"""Boris' stepper, the standard for charged particles in magnetic fields."""

from collections.abc import Sequence
from typing import ClassVar, Self

from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import Effect, Force
from tisim.forces.loads import FORCE
from tisim.program.phases import PerParticle, Phase
from tisim.state.fields import Field, WorldField
from tisim.steppers.base import Stepper
from tisim.steppers.common import (
    FORCE_BEFORE,
    AdvanceClock,
    BeginStep,
    apply_displacement,
    apply_operators,
    displaced,
    drift,
    report_displacement,
    rounding_fields,
)
from tisim.steppers.context import Step, StepContext
from tisim.steppers.implicit.one_particle import solved, summed_jacobian, with_jacobian
from tisim.steppers.step_control import Controller, FixedStep
from tisim.steppers.step_guard import STEP_EXCESS, STRAINED, check_step, guard_fields


class Boris(Stepper):
    """Boris' stepper, the standard for charged particles in magnetic fields, is explicit and of second order.

        r += dt/2 v,    v- = v + dt/2m F_0,    (1 - dt/2m J) v+ = (1 + dt/2m J) v-,    v = v+ + dt/2m F_0,
        r += dt/2 v

    Forces are evaluated at the middle of the step, F = F_0 + J v, with J from ``velocity_jacobian``. For the
    Lorentz force the middle equation is Boris' rotation: it conserves the speed up to rounding for any step
    length. There is one force evaluation per step; torques change the spin in one kick, at the middle.

    Source: J. P. Boris, Proc. 4th Conf. Numerical Simulation of Plasmas (1970) 3-67; C. K. Birdsall, A. B.
    Langdon, Plasma Physics via Computer Simulation (1985), section 4-3.
    """

    control: Controller = option("step control", examples=[FixedStep(dt=1e-6)])

    world_fields: ClassVar = (WorldField("time_before", "real", "s"), STEP_EXCESS)
    follows_shear: ClassVar = True

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        linear = any(effect.offers("velocity_jacobian") for effect in effects if isinstance(effect, Force))
        return (cls(control=FixedStep(dt=dt)),) if linear else ()

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        return (FORCE, *guard_fields(effects), *rounding_fields())

    def step(self, context: StepContext) -> Step:
        report = report_displacement(context)
        kick = (*context.update_lists, *context.sum_forces, BorisRotation(context))
        end = (*apply_operators(context), AdvanceClock(context))
        before = (BeginStep(context), Middle(context), BorisDrift(context, 0.5), *report)
        return Step((*before, *kick, BorisDrift(context, 1.0), *report, *end))


class Middle(Phase):
    """This phase sets the time to the middle of the step, at which forces are evaluated."""

    def __init__(self, context: StepContext) -> None:
        self.s = context.s

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.time_before[w] = s.time[w]
        s.time[w] += 0.5 * s.dt[w]


class BorisDrift(PerParticle):
    """This phase moves particles by half a drift, r += dt/2 v, which ends at a given part of the step."""

    def __init__(self, context: StepContext, part: float) -> None:
        super().__init__(context.s)
        self.domain, self.part = context.domain, part

    @ti.func
    def run(self, w, i):
        s = self.s
        moved = 0.5 * ti.cast(s.dt[w], s.real) * s.velocity[w, i]
        r, end = s.position[w, i], s.time_before[w] + self.part * s.dt[w]
        beside = ti.cast(moved, ti.f64) - 0.5 * s.dt[w] * drift(s, self.domain, w, r)
        place = displaced(s, w, i, r, moved)
        apply_displacement(s, self.domain, w, i, place, beside, ti.cast(0.0, ti.f64), end)


class BorisRotation(PerParticle):
    """This phase takes v- to v+ and then to the new v, with the forces at the middle of the step."""

    def __init__(self, context: StepContext) -> None:
        super().__init__(context.s)
        self.linear, self.turning = with_jacobian(context.single_forces), context.turning
        self.guarded, self.patient = FORCE_BEFORE in context.s.fields, STRAINED in context.s.fields

    @ti.func
    def run(self, w, i):
        s = self.s
        dt, m = ti.cast(s.dt[w], s.real), s.mass[w, i]
        half, free = 0.5 * dt / m, s.force[w, i]
        if ti.static(len(self.linear) > 0):
            jacobian = summed_jacobian(self.linear, s, w, i, s.time[w])
            free -= jacobian @ s.velocity[w, i]
            rest = half * free
            one, turn = ti.Matrix.identity(s.real, 3), half * jacobian
            self.guard(w, i, free)
            minus = s.velocity[w, i] + rest
            s.velocity[w, i] = solved(one - turn, (one + turn) @ minus) + rest
        else:
            self.guard(w, i, free)
            s.velocity[w, i] = s.velocity[w, i] + 2.0 * half * free
        if ti.static(self.turning):
            turn = dt / (0.4 * m * s.radius[w, i]) * (s.torque[w, i] / s.radius[w, i])
            s.spin[w, i] = s.spin[w, i] + turn

    @ti.func
    def guard(self, w, i, free):
        """Compare the velocity-independent part of the force with its value in the last step. (The part
        linear in velocity is stepped exactly.)"""
        s = self.s
        if ti.static(self.guarded):
            torque = 0.0 * free
            if ti.static(self.turning):
                torque = s.torque[w, i]
            if s.steps[w] > 1:
                dt = ti.cast(s.dt[w], s.real)
                path = dt * s.velocity[w, i].norm()
                check_step(s, w, i, dt, path, free, torque, self.turning, self.patient)
            s.force_before[w, i] = free
            if ti.static(self.turning):
                s.torque_before[w, i] = torque
