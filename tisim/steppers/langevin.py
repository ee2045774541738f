"""Langevin dynamics: particles with inertia in a fluid that slows and heats them.

The splitting is BAOAB, with kicks and drifts of b dt in place of dt. Each of its three parts is exact: kicks
by the forces (B), drifts (A), and the Ornstein-Uhlenbeck process of friction and noise (O). With a = gamma
dt/m, c = exp(-a), b^2 = tanh(a/2) / (a/2), and normal numbers g,

    v += b dt/2 F/m,    r += b dt/2 v,    v = c v + sqrt((1 - c^2) kT/m) g,    r += b dt/2 v,
    v += b dt/2 F'/m

BAOAB gives the exact variance of the position in a harmonic trap, kT/k for any stable step, with one force
evaluation a step. Its free particles diffuse too fast, by (a/2) coth(a/2) = 1/b^2; the factor b makes their
diffusion and their drift under a force exact too (tests/benchmarks/langevin.py compares six schemes). The
scheme of Groenbech-Jensen and Farago (2013) shares these properties, but replaces c by (1 - a/2) / (1 + a/2),
which is negative for a > 2: velocities then alternate.

In a flow u the factor b scales the velocity relative to the fluid only, as the fluid carries particles along
with all of u: r += dt/2 (u + b (v - u)).
"""

from collections.abc import Sequence
from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, Force, PairForce, SceneParts
from tisim.effects.external.drag import Drag
from tisim.errors import must
from tisim.forces.loads import FORCE
from tisim.numerics.tanh import tanh_ratio
from tisim.program.phases import PerParticle
from tisim.state.fields import Field
from tisim.steppers.base import Stepper
from tisim.steppers.brownian.fluid import Fluid
from tisim.steppers.common import FORCE_BEFORE, BeginStep, MoveParticles, displaced, rounding_fields
from tisim.steppers.context import Step, StepContext
from tisim.steppers.step_control import Controller, FixedStep
from tisim.steppers.step_guard import STEP_EXCESS, STRAINED, check_step, guard_fields
from tisim.steppers.verlet import Advance

PATH = Field("path", "m", 1, "keep", scratch=True)
"""The length of the displacement of a particle in a step, for the step guard."""


class Langevin(Stepper):
    """Langevin dynamics moves particles with inertia in a fluid that slows and heats them.

        m dv = F dt - gamma (v - u) dt + sqrt(2 gamma kT) dW,    gamma = 6 pi eta R

    u is the sum of all sources of a flow velocity, F the sum of forces, and W a Wiener process. A step, with
    one force evaluation, is the splitting BAOAB with b dt in place of dt, where a = gamma dt/m, c = exp(-a),
    b^2 = tanh(a/2) / (a/2), and g is normal noise:

        v += b dt/2 F/m,    r += b dt/2 v,    v = c v + sqrt((1 - c^2) kT/m) g,    r += b dt/2 v,
        v += b dt/2 F'/m

    For any a, free particles have the exact velocity distribution and correlation, and the exact diffusion;
    under a constant force they drift at F/gamma. In a trap of stiffness k = m omega^2 the variance of the
    position is kT/k for any step below the critical one, b omega dt = 2. The variance of the velocity there
    is kT/m (1 - (b omega dt)^2 / 4), and the mean velocity of a falling particle F/(b gamma), which is exact
    to second order in dt. Other statistics are of second order as well, in smooth forces that depend on
    position only. A step above 0.45 of the critical step stops the world.

    The friction is Stokes's drag of an isolated sphere, so drag laws are refused, which would count it
    twice. Spheres do not rotate, so torques are refused; magnetic forces on charges are refused as by
    ``verlet``. Contacts and impacts that dissipate energy make particles colder than the fluid. Particles
    whose field ``fixed`` is not 0 stay in place.

    Source: B16 Eqs (6.1), (6.2), (6.4); B. Leimkuhler, C. Matthews, Appl. Math. Res. Express 2013 (2013) 34;
    b: D. A. Sivak, J. D. Chodera, G. E. Crooks, J. Phys. Chem. B 118 (2014) 6466.
    """

    temperature: float = parameter("K", "temperature T of the fluid", examples=[300.0], ge=0)
    viscosity: float = parameter("Pa s", "dynamic viscosity eta of the fluid", examples=[1e-3], gt=0)
    control: Controller = option("step control", examples=[FixedStep(dt=1e-9)])

    random: ClassVar = True
    world_fields: ClassVar = (STEP_EXCESS,)

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        for effect in scene.effects:
            name = f"effects.{effect.label}"
            rule = "left out in a scene stepped by langevin, which has Stokes's drag in itself"
            must(not isinstance(effect, Drag), name, rule, effect.kind())
            turns = isinstance(effect, Force | PairForce) and effect.turns(scene.effects)
            must(not turns, name, "without torques in a scene stepped by langevin", name)
            rule = f"one that turns velocities, such as boris or collocation, with {name}"
            must(not effect.gyrates(scene.effects), "stepper", rule, self.kind())

    def rivals(self, effects: Sequence[Effect], dt: float) -> tuple[Any, ...]:
        # No other stepper has the noise of particles with inertia.
        return ()

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        guard = guard_fields(effects)
        return (FORCE, *guard, *((PATH,) if guard else ()), *rounding_fields())

    def step(self, context: StepContext) -> Step:
        fluid = Fluid(context)
        drift = (BeginStep(context), KickAndScatter(context, fluid), Advance(context))
        kick = (LastKick(context, fluid),) if context.forced else ()
        return Step((*drift, *context.update_lists, *context.sum_forces, *kick))


@ti.func
def friction(fluid: ti.template(), w, i, dt):  # type: ignore[valid-type]
    """Return h = tanh(a/2), from which c = (1 - h) / (1 + h), and b, with a = gamma dt/m."""
    half = 0.5 * dt / (fluid.s.mass[w, i] * fluid.mobility(w, i))
    ratio = tanh_ratio(half)
    # Of an infinite argument.
    h = ti.select(half > 1e3, 1.0, half * ratio)
    return h, ti.sqrt(ratio)


class KickAndScatter(MoveParticles):
    """This phase is the step up to the new forces: half a kick, half a drift, friction and noise, half a
    drift."""

    def __init__(self, context: StepContext, fluid) -> None:
        super().__init__(context)
        self.fluid, self.forced = fluid, context.forced
        self.guarded, self.flows = FORCE_BEFORE in context.s.fields, len(fluid.streams) > 0

    @ti.func
    def move(self, s, w, i, dt):
        if self.fluid.mobile(w, i) > 0:
            h, b = friction(self.fluid, w, i, dt)
            half, r, v = 0.5 * dt, s.position[w, i], s.velocity[w, i]
            if ti.static(self.guarded):
                s.force_before[w, i] = s.force[w, i]
            if ti.static(self.forced):
                v += b * half / s.mass[w, i] * s.force[w, i]
            u = self.fluid.flow(w, r, s.time[w])
            path = half * (u + b * (v - u))
            if ti.static(self.flows):
                middle = s.time[w] + 0.5 * s.dt[w]
                u = self.fluid.flow(w, self.domain.wrap(w, r + path, middle), middle)
            width = 2.0 * ti.sqrt(h * self.fluid.heat(w) / s.mass[w, i])
            noise = width * self.fluid.normals(w, i, s.steps[w])
            v = u + ((1.0 - h) * (v - u) + noise) / (1.0 + h)
            path += half * (u + b * (v - u))
            if ti.static(self.guarded):
                s.path[w, i] = path.norm()
            s.velocity[w, i], s.position[w, i] = v, displaced(s, w, i, r, path)


class LastKick(PerParticle):
    """This phase is the second half of the kick, by the new forces."""

    local = True

    def __init__(self, context: StepContext, fluid) -> None:
        super().__init__(context.s)
        self.fluid = fluid
        self.guarded, self.patient = FORCE_BEFORE in context.s.fields, STRAINED in context.s.fields

    @ti.func
    def run(self, w, i):
        s = self.s
        if self.fluid.mobile(w, i) > 0:
            dt = ti.cast(s.dt[w], s.real)
            scaled = friction(self.fluid, w, i, dt)[1] * dt
            if ti.static(self.guarded):
                force = s.force[w, i]
                check_step(s, w, i, scaled, s.path[w, i], force, 0.0 * force, False, self.patient)
            s.velocity[w, i] += 0.5 * scaled / s.mass[w, i] * s.force[w, i]
