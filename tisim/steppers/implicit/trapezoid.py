"""The adaptive implicit stepper of Z13 (appendix) and Z16 (section 8, appendix C)."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, Self

from tisim.components.accuracy_parameter import three_digits
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, Force, PairForce
from tisim.interactions.force_sum import FORCE
from tisim.steppers.base import Parts, Stepper
from tisim.steppers.common import Arrive, Listen, Operate
from tisim.steppers.implicit.anderson import accelerated, memory_of_iterates
from tisim.steppers.implicit.attempts import Begin, Decide, RestoreState, SaveState, StepAttempt
from tisim.steppers.implicit.independent import KEEPS, PLACE, Alone, EndStretch, Stretch
from tisim.steppers.implicit.one_particle import Solve
from tisim.steppers.implicit.saved_state import CHANGE, kept
from tisim.steppers.implicit.span import Went, spans
from tisim.steppers.implicit.step_control import ErrorControl, IterationControl
from tisim.steppers.implicit.trapezoid_phases import (
    ChooseTrapezoidStep,
    Correct,
    Iteration,
    JudgeIteration,
    PredictEnd,
)
from tisim.worlds.block_sum import BlockSums
from tisim.worlds.program import Item
from tisim.worlds.state import Field

OWN = (Field("own_dt", "s", 1, "keep", scratch=True), *PLACE)
"""Of a particle alone: its next step, and where it is on its way."""


class Trapezoid(Stepper):
    """The implicit trapezoidal rule advances time; its equations are solved by fixed-point iteration.

        v' = v + dt/m (phi F' + (1 - phi) F),    r' = r + dt (phi v' + (1 - phi) v),    spin as v

    F' is the force at the end of the step: each iterate is made with the force that positions, velocities and
    spins of the last one give, at the end of the step. The first one takes F itself. Each world has its own
    step, iterations and end.

    The part of the force that is linear in velocity, of effects that give ``velocity_jacobian``, is solved
    exactly with each iterate. Anderson's acceleration makes iterates from the last two, which converges in
    fewer of them, and where plain iteration does not. Particles that do not feel each other take their own
    steps and meet at every multiple of ``control.longest``; a step of the world is then from one to the next.

    Source: Z13 (A1)-(A10); Z16 (8.4), (C.1)-(C.5).
    """

    phi: float = parameter(
        "",
        "weight phi of the end of a step: 1/2 of second order, 1 implicit Euler, 0 explicit",
        0.5,
        ge=0,
        le=1,
    )
    control: IterationControl = option("step control", IterationControl())
    acceleration: Literal["none", "anderson"] = option("how the iteration is accelerated", "none")

    counters: ClassVar = ("rejections", "solver_iterations", "force_evaluations")
    world_quantities: ClassVar = (
        *("time_before", "iterating", "attempting", "verdict", "solver_iteration", "next_dt"),
        *KEEPS,
    )

    @property
    def order(self) -> int:
        return 2 if self.phi == 0.5 else 1

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        if not any(isinstance(effect, Force | PairForce) for effect in effects):
            return ()
        limits = {"first": dt, "longest": dt, "shortest": min(1e-12, three_digits(1e-3 * dt))}
        papers = IterationControl(tolerance=1e-6, **limits)
        own = ErrorControl(error=1e-4, tolerance=1e-5, **{**limits, "longest": three_digits(1e3 * dt)})
        together = any(isinstance(effect, PairForce) for effect in effects)
        accelerated = (cls(control=own, acceleration="anderson"),) if together else ()
        return (cls(control=own), *accelerated, cls(control=papers), cls(phi=1.0, control=papers))

    def evaluations(self, work: Mapping[str, int], particles: int, independent: bool) -> float:
        return work["force_evaluations"] / (particles if independent else 1)

    def fields(self, turning: bool, independent: bool) -> tuple[str | Field, ...]:
        if independent:
            return (FORCE, *OWN, *spans(self.control.at_end))
        accelerated = self.acceleration == "anderson"
        more = (*spans(self.control.at_end), *(memory_of_iterates(turning) if accelerated else ()))
        return (FORCE, *kept(turning), CHANGE, *more)

    def step(self, parts: Parts) -> tuple[Item, ...]:
        s, solve = parts.s, Solve(parts, self.phi)
        if parts.independent:
            return (Stretch(s, parts.control), Alone(parts, solve), EndStretch(parts))
        listen = (Listen(parts),) if parts.near else ()
        sums = BlockSums(s, 4)
        parts.owned.append((sums, "sums of the iteration", self.kind()))
        forces = (*parts.lists, *parts.trial_forces)
        if self.acceleration == "anderson":
            forces = accelerated(parts, forces)
        iteration = Iteration(s, (*forces, Correct(parts, sums, solve), *listen, JudgeIteration(parts, sums)))
        attempt = (
            ChooseTrapezoidStep(parts),
            PredictEnd(solve),
            *listen,
            iteration,
            RestoreState(solve),
            *listen,
            Decide(parts),
        )
        operate = (Operate(parts), *listen) if parts.operators else ()
        note = (Went(solve),) if self.control.at_end else ()
        return (
            Begin(s),
            SaveState(solve),
            StepAttempt(s, attempt),
            *note,
            *parts.remember,
            *operate,
            Arrive(s),
        )
