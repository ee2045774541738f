"""The mechanical contraction method: random packings of hard bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Literal, Self

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, HardBodies, SceneParts
from tisim.errors import must
from tisim.pairs.listed_pairs import sum_phases
from tisim.program.phases import PerParticle, Phase
from tisim.state.fields import Field, WorldField
from tisim.state.status import WorldStatus
from tisim.steppers.common import BeginStep
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.packing.overlaps import (
    INVERSE_OVERLAP,
    OVERLAP_PUSH,
    OVERLAP_TWIST,
    REMOVAL_RATE,
    RemovalRates,
    SumOverlaps,
)
from tisim.steppers.packing.packing_stepper import (
    ACCEPTED_FIELDS,
    ATTEMPT_FIELDS,
    CONTRACT,
    MOVE,
    PACKING_FIELDS,
    RETURN,
    BeginAttempt,
    MoveOrReturn,
    PackingStepper,
    body_volume,
)
from tisim.steppers.packing.space import CheckWidth, PackingSpace
from tisim.steppers.verlet import Advance

MEETING_AXES = 1e-6
"""The least distance of two axes that the original method assumes, over the sum of the radii."""


class MechanicalContraction(PackingStepper):
    """Mechanical contraction packs hard bodies: it contracts the system until overlaps remain.

    After each small contraction it tries to remove the overlaps by moving and turning bodies:

        v_i = (lambda m_i)^-1 sum_j n_ij,    omega_i = (lambda I_i)^-1 sum_j r_ij x n_ij,
        r_i += dt delta_i v_i                                                     (3.6)-(3.12), revised
        v_i = sum_j delta_ij k_ij,    omega_i = xi^-1 sum_j delta_ij r_ij x k_ij,
        r_i += v_i beta min_j delta_ij / ((v_i + omega_i x r_ij) . n_ij)          (2.7)-(2.10), original

    n is the normal along which body i leaves body j, k the vector between the axes, delta the overlap,
    delta_i the smallest overlap of i, and lambda makes the kinetic energy of each body equal to 1. Lengths
    are in units of D, the shortest side of the box around the first shape, and densities are 1.

    One step is one attempt to remove all overlaps; it takes the time ``dt`` of the control, so the duration
    of a run is the largest number of attempts. The box keeps its size and the bodies grow, which is the same
    as a contracting box up to the scale of all lengths. A cylinder or a wedge grows with the bodies, except
    along its periodic axis. If overlaps remain after ``attempts``, the world returns to its last
    configuration without overlaps, and contracts by half the step. It ends in that configuration after
    ``halvings``. The measure ``packing_fraction`` of the result is its density.

    The original method is for rods. Overlaps of the start are removed first.

    Source: B16 chapters 2 and 3; S. R. Williams, A. P. Philipse, Phys. Rev. E 67 (2003) 051301.
    """

    method: Literal["revised", "original"] = option("the way in which bodies are moved", "revised")
    volume_step: float = parameter("D^3", "first step by which the volume decreases", 0.1, gt=0)
    halvings: int = option("how often the step of the volume is halved before a world ends", 4, ge=0)
    attempts: int = option("attempts to remove the overlaps of a contraction", 100_000, ge=1)
    tolerance: float = parameter("D", "overlap that is permitted", 1e-4, ge=0)
    motion: float = parameter("", "step dt of the revised method", 0.1, gt=0)
    fraction: float = parameter("", "fraction beta of the original method", 0.5, gt=0)
    inertia: float = parameter(
        "D^2", "xi over the moment of inertia of a body of mass 1, of the original method", 1.0, gt=0
    )

    world_fields: ClassVar = (
        *PACKING_FIELDS,
        *ATTEMPT_FIELDS,
        WorldField("contractions", "counter"),
        WorldField("halved", "integer"),
        WorldField("box_volume", "real"),
        WorldField("volume_decrease", "real"),
        WorldField("solid_volume", "real"),
        WorldField("packing_fraction", "measure"),
    )

    @property
    def accuracy_parameters(self) -> tuple[AccuracyParameter, ...]:  # type: ignore[override]
        # The distance from the jamming density is measured to fall as attempts^-0.5 (docs/packings.md). The
        # other settings have no order; they change the number of attempts that are needed.
        moved = (AccuracyParameter(motion=1, converges=False),) if self.method == "revised" else ()
        return (
            AccuracyParameter(attempts=-0.5, converges=False),
            AccuracyParameter(volume_step=1, converges=False),
            AccuracyParameter(tolerance=1, converges=False),
            *moved,
        )

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        hard = [effect for effect in effects if isinstance(effect, HardBodies)]
        if not hard:
            return ()
        rods = all(shape.rod() for shape in hard[0].shapes())
        return (cls(method="original" if rods else "revised", attempts=2000),)

    def rivals(self, effects: Sequence[Effect], dt: float) -> tuple[Any, ...]:
        other = "original" if self.method == "revised" else "revised"
        return (self.model_copy(update={"method": other}), *super().rivals(effects, dt))

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        (bodies,) = (effect for effect in scene.effects if isinstance(effect, HardBodies))
        suited = self.method != "original" or all(shape.rod() for shape in bodies.shapes())
        must(suited, "method", "'revised' for bodies that are not rods", self.method)

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        return (
            OVERLAP_PUSH,
            OVERLAP_TWIST,
            INVERSE_OVERLAP,
            *((REMOVAL_RATE,) if self.method == "original" else ()),
            *ACCEPTED_FIELDS,
        )

    @ti.func
    def weight(self, depth):
        """Return the weight of an overlap in the sums of a body: in the original method the product of the
        overlap and the distance of the axes, both over the sum of the radii.

        depth : overlap over the sum of the radii.
        """
        weight = 0.0 * depth + 1.0
        if ti.static(self.method == "original"):
            # Axes that meet have a distance too, for otherwise nothing would move them apart.
            weight = depth * ti.max(1.0 - depth, MEETING_AXES)
        return weight

    def step(self, context: StepContext) -> Step:
        (bodies,) = context.effects.of(HardBodies)
        overlaps, space = SumOverlaps(context, bodies), PackingSpace(context)
        shared = overlaps.exported()
        # Lists may have been lengthened since the last step, and are then empty.
        items = [*context.update_lists, BeginAttempt(context), *sum_phases(overlaps, shared)]
        items.append(ChooseAction(context, bodies, space))
        buffers = [Buffer(shared, "overlaps between chunks", self.kind())]
        if self.method == "original":
            rates = RemovalRates(context, bodies)
            memory = rates.exported()
            items += [ScaleTwist(context, bodies), *sum_phases(rates, memory)]
            buffers.append(Buffer(memory, "removal rates between chunks", self.kind()))
        items += [BeginStep(context), RemoveOverlaps(context, bodies), CheckWidth(context), Advance(context)]
        return Step(tuple(items), tuple(buffers))


class ChooseAction(Phase):
    """This phase chooses whether to remove overlaps, to contract the world, or to return to the last
    configuration without overlaps."""

    def __init__(self, context: StepContext, bodies: Any, space: PackingSpace) -> None:
        self.s, self.stepper, self.bodies = context.s, context.stepper, bodies
        self.space, self.control = space, context.control

    @ti.func
    def run(self, w, _k):
        s = self.s
        if s.steps[w] == 0:
            unit = self.bodies.size(s, w, 0) * self.bodies.unit(w, 0)
            s.box_volume[w] = self.space.volume(w, unit)
            # In D^3, so it stays the same while bodies grow.
            s.solid_volume[w] = ti.cast(0.0, ti.f64)
            for i in range(s.count[w]):
                s.solid_volume[w] += body_volume(s, self.bodies, w, i) / ti.cast(unit, ti.f64) ** 3
            s.volume_decrease[w] = ti.cast(self.stepper.volume_step(w), ti.f64)
        last = s.end[w] - s.time[w] <= ti.cast(1.5, ti.f64) * ti.cast(self.control.dt(w), ti.f64)
        volume, ends = s.box_volume[w], False
        given_up = s.attempted[w] >= self.stepper.attempts and s.contractions[w] > 0
        s.packing_action[w] = MOVE
        if s.overlapping[w] == 0:
            s.packing_action[w] = CONTRACT
            s.contractions[w] += 1
            s.attempted[w] = 0
        elif given_up or last:
            s.packing_action[w] = RETURN
            # The last contraction is taken back.
            volume += s.volume_decrease[w]
            s.attempted[w] = 0
            s.halved[w] += 1
            s.volume_decrease[w] = 0.5 * s.volume_decrease[w]
            s.jammed[w] = ti.cast(given_up and s.halved[w] > self.stepper.halvings, ti.i64)
            ends = last or s.jammed[w] == 1
            if s.contractions[w] == 0:
                # There is no configuration without overlaps to return to.
                s.fail(w, WorldStatus.OVERLAPPING, 0)
        else:
            s.attempted[w] += 1
        s.growth[w] = 1.0
        if s.packing_action[w] != MOVE:
            s.box_volume[w] = volume
            if not (ends or last):
                # Half of the volume remains, also after a step that is longer than the box.
                s.volume_decrease[w] = ti.min(s.volume_decrease[w], 0.5 * volume)
                s.box_volume[w] = volume - s.volume_decrease[w]
                s.growth[w] = self.space.growth(volume, s.box_volume[w])
        s.packing_fraction[w] = s.solid_volume[w] / s.box_volume[w]
        if ends:
            s.end[w] = s.time[w] + ti.cast(self.control.dt(w), ti.f64)


class ScaleTwist(PerParticle):
    """This phase turns the moments of a body into its angular velocity, in the original method."""

    def __init__(self, context: StepContext, bodies: Any) -> None:
        super().__init__(context.s)
        self.stepper, self.bodies = context.stepper, bodies

    @ti.func
    def run(self, w, i):
        s, k = self.s, self.s.shape[w, i]
        length = self.bodies.bounding(w, k) / self.bodies.unit(w, 0)
        moment = length * length * self.bodies.moment_x(w, k)
        s.overlap_twist[w, i] = s.overlap_twist[w, i] / (self.stepper.inertia(w) * moment)


class RemoveOverlaps(MoveOrReturn):
    """This phase moves each body out of its overlaps."""

    @ti.func
    def motion(self, w, i):
        """Return the displacement (m) and the rotation vector (rad) of a body that removes its overlaps."""
        s = self.s
        push, twist = s.overlap_push[w, i], s.overlap_twist[w, i]
        size = self.bodies.size(s, w, i) * self.bodies.unit(w, 0)
        shift, turn = 0.0 * push, 0.0 * push
        if s.inverse_overlap[w, i] > 0.0:
            if ti.static(self.stepper.method == "revised"):
                mass, spin = self.bodies.mass(s, w, i), self.bodies.spun(s, w, i, twist)
                energy = 0.5 * (push.norm_sqr() / mass + twist.dot(spin))
                if energy > 0.0:
                    part = self.stepper.motion(w) / ti.sqrt(energy) / s.inverse_overlap[w, i]
                    shift, turn = part / mass * push, part / size * spin
            else:
                if s.removal_rate[w, i] > 0.0:
                    part = self.stepper.fraction(w) / s.removal_rate[w, i]
                    shift, turn = part * push, part / size * twist
        return shift, turn
