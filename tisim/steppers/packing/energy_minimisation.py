"""Random packings of hard bodies by minimising the energy of overlaps, with bisection of the density."""

from collections.abc import Sequence
from typing import Any, ClassVar, Self

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, HardBodies
from tisim.pairs.listed_pairs import sum_phases
from tisim.program.phases import Phase
from tisim.program.scans import BlockSums, PerBlock
from tisim.state.fields import Field, WorldField
from tisim.state.status import WorldStatus
from tisim.steppers.common import BeginStep
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.packing.overlaps import (
    DEEPEST_OVERLAP,
    OVERLAP_ENERGY,
    OVERLAP_PUSH,
    OVERLAP_TWIST,
    SumSoftOverlaps,
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

FIRE_FIELDS = (
    Field("fire_velocity", "", 3, "keep"),
    Field("fire_momentum", "", 3, "keep"),
)
"""Velocity and angular momentum of a body of mass 1, with lengths in its D and times in units of FIRE."""
POWER, SPEED_SQUARE, FORCE_SQUARE, OVERLAP_SUM, BODY_VOLUME = range(5)
"""The sums over all bodies: F.v, v^2, F^2, the energy, and the volume (m^3). Torques and angular momenta are
included, as components divided by the roots of the moments of inertia."""
FIRST_MIXING, LESS_MIXING, FASTER, SLOWER, DOWNHILL, SHORTEST = 0.25, 0.99, 1.1, 0.5, 20, 0.02
"""FIRE 2.0: alpha at the start, its factor and the factor of dt after ``DOWNHILL`` steps downhill, the factor
of dt after a step uphill, and the shortest dt over the first one."""
STALLED = 0.99
"""Energy after ``patience`` evaluations over the energy before, above which a configuration is jammed."""
TARGET_ROUNDING = 1e-6
"""A density that differs from the target by this part of it, by rounding, has reached it."""


class EnergyMinimisation(PackingStepper):
    """Energy minimisation finds the density at which overlaps of soft bodies can no longer be removed.

    Overlapping bodies repel each other by springs. At each density FIRE minimises their energy:

        U = 1/2 sum_pairs (delta_ij/D_ij)^2
        v += dt F,    v = (1 - alpha) v + alpha |v| F/|F|,    r += dt v

    delta is the overlap and D_ij the mean of both D. F and v are forces and velocities of all bodies, of mass
    1, together with their torques and angular momenta. While F.v > 0, dt grows and alpha decreases; otherwise
    the bodies stop, half a step back.

    If no overlap exceeds ``tolerance``, the configuration is accepted and the bodies grow. It is jammed if
    the forces balance, that is if |F| is less than ``balance`` times the root of the sum of all squared
    contact forces, or if the energy does not fall by 1 % in ``patience`` evaluations. (Rods that lie side
    by side have no smooth energy, so their forces need not balance.) The world then returns to the last
    accepted configuration, and the density is bisected between the highest accepted and the lowest jammed
    one, until they differ by less than ``precision``. A world ends in its last accepted configuration, or
    as soon as an accepted one has the density ``target``. The measures ``packing_fraction`` and
    ``jammed_fraction`` of the result are both densities; the second one is 0 if the run has ended before any
    configuration was jammed.

    One step is one evaluation of the forces; it takes the time ``dt`` of the control, so the duration of a
    run is the largest number of evaluations. Overlaps of the start are removed first.

    Source: C. S. O'Hern, L. E. Silbert, A. J. Liu, S. R. Nagel, Phys. Rev. E 68 (2003) 011306, Eq. (1); J.
    Guenole et al., Comput. Mater. Sci. 175 (2020) 109584 (FIRE 2.0).
    """

    fraction_step: float = parameter(
        "", "increase of the packing fraction until it is bisected", 0.01, gt=0, le=0.1
    )
    target: float = parameter(
        "", "packing fraction at which a world ends, unless it is jammed before", 1.0, gt=0, le=1
    )
    precision: float = parameter("", "difference of densities at which bisection ends", 1e-5, gt=0)
    tolerance: float = parameter("D", "overlap that is permitted", 1e-4, gt=0)
    balance: float = parameter("", "net force over contact forces at which forces balance", 1e-3, gt=0)
    patience: int = option("evaluations in which the energy must fall by 1 %", 1000, ge=1)
    first: float = parameter("", "first step dt of FIRE", 0.05, gt=0)
    longest: float = parameter("", "longest step dt of FIRE", 0.3, gt=0)

    accuracy_parameters: ClassVar = (
        AccuracyParameter(precision=1, tolerance=1),
        AccuracyParameter(balance=1, converges=False),
    )
    world_fields: ClassVar = (
        *PACKING_FIELDS,
        *ATTEMPT_FIELDS,
        WorldField("contractions", "counter"),
        WorldField("bisections", "counter"),
        WorldField("packing_fraction", "measure"),
        WorldField("jammed_fraction", "measure"),
        WorldField("fire_dt", "real"),
        WorldField("fire_mixing", "real"),
        WorldField("fire_keep", "real"),
        WorldField("fire_along", "real"),
        WorldField("fire_back", "real"),
        WorldField("fire_energy", "real"),
        WorldField("fire_downhill", "integer"),
    )

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        return (cls(),) if any(isinstance(effect, HardBodies) for effect in effects) else ()

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        sums = (OVERLAP_PUSH, OVERLAP_TWIST, OVERLAP_ENERGY, DEEPEST_OVERLAP)
        return (*sums, *FIRE_FIELDS, *ACCEPTED_FIELDS)

    def step(self, context: StepContext) -> Step:
        (bodies,) = context.effects.of(HardBodies)
        overlaps, sums = SumSoftOverlaps(context, bodies), BlockSums(context.s, 5)
        shared = overlaps.exported()
        items = (
            *context.update_lists,
            BeginAttempt(context),
            *sum_phases(overlaps, shared),
            SumPower(sums, bodies),
            MinimiseOrGrow(context, bodies, sums),
            BeginStep(context),
            FollowForces(context, bodies),
            CheckWidth(context),
            Advance(context),
        )
        buffers = (
            Buffer(shared, "overlaps between chunks", self.kind()),
            Buffer(sums, "sums over bodies", self.kind()),
        )
        return Step(items, buffers)


@ti.func
def turned(s, bodies: ti.template(), w, i, moment):  # type: ignore[valid-type]
    """Return the angular velocity of a body of mass 1 with a given angular momentum."""
    return bodies.mass(s, w, i) * bodies.spun(s, w, i, moment)


class SumPower(PerBlock):
    """This phase sums the power, the squares of velocities and forces, the energy, and the volume."""

    def __init__(self, sums: BlockSums, bodies: Any) -> None:
        super().__init__(sums)
        self.bodies = bodies

    @ti.func
    def each(self, w, i):
        s = self.s
        force, torque = s.overlap_push[w, i], s.overlap_twist[w, i]
        speed, momentum = s.fire_velocity[w, i], s.fire_momentum[w, i]
        spin, speeding = turned(s, self.bodies, w, i, momentum), turned(s, self.bodies, w, i, torque)
        terms = ti.Vector.zero(ti.f64, 5)
        terms[POWER] = ti.cast(force.dot(speed) + torque.dot(spin), ti.f64)
        terms[SPEED_SQUARE] = ti.cast(speed.norm_sqr() + momentum.dot(spin), ti.f64)
        terms[FORCE_SQUARE] = ti.cast(force.norm_sqr() + torque.dot(speeding), ti.f64)
        terms[OVERLAP_SUM] = ti.cast(s.overlap_energy[w, i], ti.f64)
        terms[BODY_VOLUME] = body_volume(s, self.bodies, w, i)
        return terms


class MinimiseOrGrow(Phase):
    """This phase chooses the step of FIRE, or to accept a configuration, or to return to the last accepted
    one; and the next density."""

    def __init__(self, context: StepContext, bodies: Any, sums: BlockSums) -> None:
        self.s, self.stepper, self.bodies, self.sums = context.s, context.stepper, bodies, sums
        self.space, self.control = PackingSpace(context), context.control

    @ti.func
    def run(self, w, _k):
        s, total = self.s, self.sums.total(w)
        unit = self.bodies.size(s, w, 0) * self.bodies.unit(w, 0)
        density = total[BODY_VOLUME] / (self.space.volume(w, unit) * ti.cast(unit * unit * unit, ti.f64))
        if s.steps[w] == 0:
            self.begin(w)
        last = s.end[w] - s.time[w] <= ti.cast(1.5, ti.f64) * ti.cast(self.control.dt(w), ti.f64)
        # A contact with force f adds 2 f^2 to the sum over bodies; its energy is f^2 / 2.
        limit = ti.cast(self.stepper.balance(w), ti.f64)
        balanced = total[FORCE_SQUARE] <= limit * limit * 4.0 * total[OVERLAP_SUM]
        stalled = False
        if s.attempted[w] % self.stepper.patience == 0:
            stalled = s.attempted[w] > 0 and total[OVERLAP_SUM] > STALLED * s.fire_energy[w]
            s.fire_energy[w] = total[OVERLAP_SUM]
        s.packing_action[w] = MOVE
        if s.overlapping[w] == 0:
            s.packing_action[w] = CONTRACT
            s.contractions[w] += 1
            s.packing_fraction[w] = density
        elif balanced or stalled or last:
            s.packing_action[w] = RETURN
            if not last:
                s.bisections[w] += 1
                s.jammed_fraction[w] = density
            if s.contractions[w] == 0:
                # There is no configuration without overlaps to return to.
                s.fail(w, WorldStatus.OVERLAPPING, 0)
        s.growth[w] = 1.0
        if s.packing_action[w] == MOVE:
            s.attempted[w] += 1
            self.choose_step(w, total)
        else:
            self.begin(w)
            self.choose_density(w, last)

    @ti.func
    def begin(self, w):
        """Begin a minimisation."""
        s = self.s
        s.attempted[w], s.fire_downhill[w] = 0, 0
        s.fire_dt[w], s.fire_mixing[w] = ti.cast(self.stepper.first(w), ti.f64), FIRST_MIXING

    @ti.func
    def choose_step(self, w, total):
        """Set dt, and the factors of velocity and force in the next velocity."""
        s = self.s
        speeds, forces, power = total[SPEED_SQUARE], total[FORCE_SQUARE], total[POWER]
        keeps = ti.cast(1.0, ti.f64)
        s.fire_back[w] = 0.0
        if power > 0.0:
            s.fire_downhill[w] += 1
            if s.fire_downhill[w] > DOWNHILL:
                s.fire_dt[w] = ti.min(s.fire_dt[w] * FASTER, ti.cast(self.stepper.longest(w), ti.f64))
                s.fire_mixing[w] = s.fire_mixing[w] * LESS_MIXING
        elif speeds > 0.0:
            s.fire_back[w], keeps = 0.5 * s.fire_dt[w], 0.0
            shortest = SHORTEST * ti.cast(self.stepper.first(w), ti.f64)
            # The first steps after a growth may go uphill without being too long.
            if s.attempted[w] > DOWNHILL:
                s.fire_dt[w] = ti.max(s.fire_dt[w] * SLOWER, shortest)
            s.fire_downhill[w], s.fire_mixing[w] = 0, FIRST_MIXING
        dt, mixing = s.fire_dt[w], s.fire_mixing[w]
        # The square of v + dt F.
        square = keeps * (speeds + 2.0 * dt * power) + dt * dt * forces
        s.fire_keep[w] = keeps * (1.0 - mixing)
        s.fire_along[w] = (1.0 - mixing) * dt + mixing * ti.sqrt(square / forces)

    @ti.func
    def choose_density(self, w, last):
        """Set the growth of the accepted configuration; end if its density is the target, or is known to be
        the last one."""
        s = self.s
        density, jammed = s.packing_fraction[w], s.jammed_fraction[w]
        target = ti.cast(self.stepper.target(w), ti.f64)
        aim = ti.min(density + ti.cast(self.stepper.fraction_step(w), ti.f64), target)
        reached = density >= (1.0 - TARGET_ROUNDING) * target
        if jammed > 0.0:
            aim = 0.5 * (density + jammed)
            s.jammed[w] = ti.cast(jammed - density <= ti.cast(self.stepper.precision(w), ti.f64), ti.i64)
        if last or reached or s.jammed[w] == 1:
            s.end[w] = s.time[w] + ti.cast(self.control.dt(w), ti.f64)
        elif density > 0.0:
            s.growth[w] = self.space.growth(aim, density)


class FollowForces(MoveOrReturn):
    """This phase moves and turns each body by a step of FIRE."""

    @ti.func
    def motion(self, w, i):
        s = self.s
        dt, back = ti.cast(s.fire_dt[w], s.real), ti.cast(s.fire_back[w], s.real)
        keep, along = ti.cast(s.fire_keep[w], s.real), ti.cast(s.fire_along[w], s.real)
        speed, momentum = s.fire_velocity[w, i], s.fire_momentum[w, i]
        path, turn = -back * speed, -back * momentum
        speed = keep * speed + along * s.overlap_push[w, i]
        momentum = keep * momentum + along * s.overlap_twist[w, i]
        s.fire_velocity[w, i], s.fire_momentum[w, i] = speed, momentum
        size = self.bodies.size(s, w, i) * self.bodies.unit(w, 0)
        return size * (path + dt * speed), turned(s, self.bodies, w, i, turn + dt * momentum)

    @ti.func
    def rest(self, w, i):
        self.s.fire_velocity[w, i], self.s.fire_momentum[w, i] = 0.0, 0.0
