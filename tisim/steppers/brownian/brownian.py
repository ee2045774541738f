"""Brownian dynamics of D. L. Ermak and J. A. McCammon, J. Chem. Phys. 69, 1352 (1978)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from tisim.components.component import option, parameter
from tisim.effects.base import Effect, Force, PairEvent, PairForce, SceneParts
from tisim.errors import must
from tisim.forces.loads import FORCE
from tisim.operators.base import Operator
from tisim.state.fields import Field, WorldField
from tisim.steppers.base import Stepper, single
from tisim.steppers.brownian.coupled import BrownianDrift, Proceed, Scatter, Separate
from tisim.steppers.brownian.drift_limit import DriftLimit
from tisim.steppers.brownian.exact_noise import GAUSS, Exact
from tisim.steppers.brownian.fast_noise import SUMS, Fast
from tisim.steppers.brownian.fluid import Fluid
from tisim.steppers.brownian.independent import (
    OWN_BROWNIAN_FIELDS,
    EndBrownianIntervals,
    IndependentBrownianSteps,
)
from tisim.steppers.brownian.mobility import Mobility, Oseen, RotnePrager
from tisim.steppers.brownian.vectorised import VectorisedBrownianSteps, vectorises
from tisim.steppers.common import BeginStep
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.intervals import INTERVALS, BeginIntervals

LONGEST_RELAXATION = 0.2
"""Steps are at most this fraction of the relaxation time of a spring."""


class Brownian(Stepper):
    """Brownian dynamics moves particles without inertia: by the flow, by forces and by thermal noise.

        dr_i = u(r_i) dt + dt/(kT) sum_j D_ij F_j + R_i,    <R_i> = 0,    <R_i R_j> = 2 D_ij dt

    u is the sum of all sources of a flow velocity, F the sum of forces, D the diffusion tensor at the start
    of the step and R normal noise. ``velocity`` is the drift velocity of the last step, u + sum_j D_ij F_j /
    kT. Its mean, and every statistic, is exact to first order in dt (weak order 1). The fluid has no inertia
    either; it is infinite, and at rest except for u.

    In a trap of stiffness k the variance of the position is kT/k / (1 - a/2), with a = dt k / (6 pi eta R);
    for a >= 2 it grows without bound. At a = 0.2 it is one ninth too large. Steps with larger a are refused
    for forces on single particles that report their stiffness (``critical_step``), such as ``tether``.

    Noise is made by a Cholesky decomposition ("exact"), or by the truncated expansion, in N^2 operations
    ("fast"). A world in which the diffusion tensor is not positive definite fails, with time and particle;
    this happens with Oseen's tensor at distances below about 3/2 R. "fast" detects only pairs whose tensor is
    not positive definite.

    Particles whose field ``fixed`` is not 0 stay in place and take no part in D. Spheres do not rotate, so
    torques are refused. Effects that depend on velocities are refused too, because particles have none here:
    drag, losses in contacts, and impacts. Hydrodynamic interaction is refused in a periodic box, because the
    tensors are those for an infinite fluid.

    If particles do not interact, and operators change them one by one, each particle takes its own steps. All
    meet at every multiple of ``control.longest``; a step of the world is then one such interval.

    Source: B16 Eqs (6.1)-(6.16).
    """

    temperature: float = parameter("K", "temperature T of the fluid", examples=[300.0], ge=0)
    viscosity: float = parameter("Pa s", "dynamic viscosity eta of the fluid", examples=[1e-3], gt=0)
    control: DriftLimit = option("step control")
    hydrodynamics: Literal["none", "oseen", "rotne-prager"] = option(
        "hydrodynamic interaction: tensor D_ij for i != j; none: D_ij = 0", "none"
    )
    noise: Literal["exact", "fast"] = option("method by which the noise is computed", "exact")

    all_pairs = True
    random: ClassVar = True
    world_fields: ClassVar = (*INTERVALS, WorldField("beta", "real"))

    @property
    def order(self) -> int:
        return 1

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        effects, domain = scene.effects, scene.domain
        for effect in effects:
            name = f"effects.{effect.label}"
            turns = isinstance(effect, Force | PairForce) and effect.turns(effects)
            must(not turns, name, "without torques in a scene stepped by brownian", name)
            rule = "one that does not depend on velocity in a scene stepped by brownian"
            must(not (effect.depends_on_velocity or isinstance(effect, PairEvent)), name, rule, name)
        fits = self.hydrodynamics == "none" or not any(domain.imaged())
        must(fits, "brownian.hydrodynamics", "none in a periodic box", self.hydrodynamics)

    def resolves(self, effects: Sequence[Effect], start: Callable[[], Mapping[str, np.ndarray]]) -> None:
        forces = [effect for effect in effects if isinstance(effect, Force) and not effect.kinked]
        quantities = start() if forces else {"mass": np.zeros(0)}
        if not len(quantities["mass"]):
            return
        lightest, smallest = float(quantities["mass"].min()), float(quantities["radius"].min())
        friction = 6 * math.pi * self.viscosity * smallest
        for effect in forces:
            critical = effect.critical_step(quantities, 0.0, effects)
            if critical is not None and math.isfinite(critical):
                # Of the spring constant k = m omega^2.
                relaxation = friction / (lightest * (2 / critical) ** 2)
                rule = (
                    f"at most {LONGEST_RELAXATION:g} of the relaxation time of effects.{effect.label}, "
                    f"6 pi eta R / k = {relaxation:.3g} s"
                )
                fits = self.control.longest <= LONGEST_RELAXATION * relaxation * (1 + 1e-9)
                must(fits, "brownian.control.longest", rule, self.control.longest)

    def independent(self, effects: Sequence[Effect]) -> bool:
        separate = all(single(effect) or _one_by_one(effect) for effect in effects)
        return separate and self.hydrodynamics == "none"

    def countable(self, effects: Sequence[Effect]) -> float:
        # If each particle takes its own steps, the noise of a step is numbered by 32 bits within its
        # interval.
        return 2**32 if self.independent(effects) else super().countable(effects)

    def rivals(self, effects: Sequence[Effect], dt: float) -> tuple[Stepper, ...]:
        if self.hydrodynamics == "none":
            return ()
        return (self.model_copy(update={"noise": "fast" if self.noise == "exact" else "exact"}),)

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        if self.independent(effects):
            return (FORCE, *OWN_BROWNIAN_FIELDS)
        if self.hydrodynamics == "none":
            return (FORCE,)
        return (FORCE, GAUSS) if self.noise == "exact" else (FORCE, *SUMS)

    def step(self, context: StepContext) -> Step:
        fluid = Fluid(context)
        if context.independent:
            advance = VectorisedBrownianSteps if vectorises(context) else IndependentBrownianSteps
            return Step((BeginIntervals(context), advance(context, fluid), EndBrownianIntervals(context)))
        interaction = self._interaction(context, fluid)
        matrix = isinstance(interaction, Exact)
        drift = (*interaction.phases(), BrownianDrift(context, fluid, interaction))
        move = (BeginStep(context), Scatter(context, fluid, interaction), Proceed(context))
        end = (*context.update_lists, *context.sum_forces)
        buffers = (Buffer(interaction, "diffusion matrix", self.kind()),) if matrix else ()
        return Step((*drift, *move, *end), buffers)

    def _interaction(self, context: StepContext, fluid: Fluid) -> Any:
        if self.hydrodynamics == "none":
            return Separate(fluid)
        mobility = Mobility(fluid, Oseen() if self.hydrodynamics == "oseen" else RotnePrager())
        if self.noise == "fast":
            return Fast(fluid, mobility, context.domain)
        return Exact(fluid, mobility, context.domain)


def _one_by_one(effect: Effect) -> bool:
    """Return whether an effect changes particles one by one and never a world as a whole."""
    return isinstance(effect, Operator) and not effect.acts_on_worlds()
