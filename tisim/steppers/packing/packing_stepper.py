"""The common part of the steppers that pack hard bodies: their attempts, and the last configuration without
overlaps."""

from collections.abc import Sequence
from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, HardBodies, SceneParts
from tisim.effects.walls.confinement import Confinement, confinement
from tisim.errors import must
from tisim.numerics import elementary
from tisim.numerics.vectors import product
from tisim.program.phases import PerParticle, Phase
from tisim.program.scans import BlockSums, PerBlock
from tisim.state.fields import Field, WorldField
from tisim.steppers.base import Stepper
from tisim.steppers.common import apply_displacement
from tisim.steppers.context import StepContext
from tisim.steppers.packing.space import PackingSpace
from tisim.steppers.step_control import SHORTEST_STEP, FixedStep

ACCEPTED_FIELDS = (
    Field("accepted_position", "m", 3, "keep", default="position", recorded=False),
    Field("accepted_orientation", "", 1, "keep", slots=4),
    Field("accepted_radius", "m", 1, "keep", default="radius", recorded=False),
)
"""The last configuration without overlaps; part of checkpoints, because a run may return to it."""
PACKING_FIELDS = (
    WorldField("overlapping", "sum"),
    WorldField("growth", "real"),
    WorldField("jammed", "counter"),
)
"""The number of bodies with overlaps, the factor by which a step enlarges bodies, and whether the world has
ended because its bodies could not be brought closer, not because of its duration."""
ATTEMPT_FIELDS = (WorldField("attempted", "integer"), WorldField("packing_action", "integer"))
"""The attempts to remove the overlaps of a contraction, and the action of a step."""
MOVE, CONTRACT, RETURN = 0, 1, 2
"""What a step does: remove overlaps, contract a configuration without overlaps, or return to the last one."""


class Attempts(FixedStep):
    """A step is one attempt to remove the overlaps of a packing, and takes a time without physical
    meaning."""

    accuracy_parameters = ()

    dt: float = parameter("s", "time of an attempt", 1.0, ge=SHORTEST_STEP)


class PackingStepper(Stepper):
    """Packing steppers bring hard bodies together in a periodic box of constant size: the bodies grow.

    The phases of a step end with ``BeginStep``, a subclass of ``MoveBodies``, ``CheckWidth`` and ``Advance``.
    Before these, a step sets ``growth`` of the world. The counter ``jammed`` of the result is 1 if a world
    has ended because its bodies could not be brought closer, and 0 if it has reached its duration, or a
    density that was its target; the reason of its status says the same.

    confines : whether bodies may be packed between walls.
    """

    contract: ClassVar[bool] = True
    packs: ClassVar = True
    ends: ClassVar = {"jammed": "jammed: its bodies could not be brought closer"}
    confines: ClassVar[bool] = True
    control: Attempts = option("time of an attempt", Attempts())

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        bodies = [effect for effect in scene.effects if isinstance(effect, HardBodies)]
        must(len(bodies) == 1, "effects", f"one with hard bodies for {self.kind()}, such as hard_rods",
             [effect.label for effect in scene.effects])  # fmt: skip
        for effect in scene.effects:
            rule = f"hard bodies alone, as {self.kind()} moves particles without forces"
            packed = effect is bodies[0] or (self.confines and isinstance(effect, Confinement))
            must(packed, f"effects.{effect.label}", rule, effect.kind())
        low, _high = scene.domain.bounds()
        # A confinement checks the axes of its box.
        closed = low is not None and (all(scene.domain.imaged()) or confinement(scene) is not None)
        rule = f"a periodic box for {self.kind()}" + ", or one with an effect confinement" * self.confines
        must(closed, "domain", rule, scene.domain.kind())

    def independent(self, effects: Sequence[Effect]) -> bool:
        return False

    def rivals(self, effects: Sequence[Effect], dt: float) -> tuple[Any, ...]:
        # Other protocols, by name, so that the order does not depend on imports.
        kinds = [kind for _, kind in sorted(PackingStepper.known().items()) if kind is not type(self)]
        return tuple(other for kind in kinds for other in kind.alternatives(effects, dt))


@ti.func
def rotated_by(turn, orientation):
    """Return an orientation, a unit quaternion, after a rotation by a rotation vector (rad)."""
    angle, q = turn.norm(), orientation
    if angle > 0.0:
        half = 0.5 * angle
        u = elementary.sin(half) / angle * turn
        q = product(ti.Vector([elementary.cos(half), u[0], u[1], u[2]]), orientation)
        q = q / q.norm()
    return q


@ti.func
def body_volume(s, bodies: ti.template(), w, i):  # type: ignore[valid-type]
    """Return the volume (m^3, f64) of a body."""
    size = ti.cast(bodies.size(s, w, i), ti.f64)
    return ti.cast(bodies.shape_volume(w, s.shape[w, i]), ti.f64) * size * size * size


class SumVolumes(PerBlock):
    """This phase sums the volumes of bodies."""

    def __init__(self, sums: BlockSums, bodies: Any) -> None:
        super().__init__(sums)
        self.bodies = bodies

    @ti.func
    def each(self, w, i):
        return ti.Vector([body_volume(self.s, self.bodies, w, i)], dt=ti.f64)


class BeginAttempt(Phase):
    """This phase resets the number of bodies with overlaps."""

    def __init__(self, context: StepContext) -> None:
        self.s = context.s

    @ti.func
    def run(self, w, _k):
        self.s.overlapping[w] = 0


class MoveBodies(PerParticle):
    """This phase moves and turns each body and lets it grow. A subclass defines ``motion``."""

    def __init__(self, context: StepContext, bodies: Any) -> None:
        super().__init__(context.s)
        self.stepper, self.bodies, self.domain = context.stepper, bodies, context.domain
        self.space = PackingSpace(context)

    @ti.func
    def run(self, w, i):
        s = self.s
        before, radius, end = s.position[w, i], s.radius[w, i], s.time[w] + s.dt[w]
        place, far = self.change(w, i, before, radius)
        growth = ti.cast(s.growth[w], s.real)
        s.radius[w, i] = s.radius[w, i] * growth
        place = self.space.grown(w, place, growth)
        grown = ti.cast(s.radius[w, i] - radius, ti.f64) + ti.cast(far, ti.f64)
        path = self.domain.nearest(w, before, place, end)
        apply_displacement(s, self.domain, w, i, place, ti.cast(path, ti.f64), grown, end)

    @ti.func
    def change(self, w, i, before, radius):
        """Turn a body; return its new place (m) and the distance (m) by which its surface has turned."""
        shift, turn = self.motion(w, i)
        self.rotate(w, i, turn)
        return before + shift, turn.norm() * radius

    @ti.func
    def motion(self, w, i):
        """Return the displacement (m) and the rotation vector (rad) of a body."""
        return 0.0 * self.s.position[w, i], 0.0 * self.s.position[w, i]

    @ti.func
    def rotate(self, w, i, turn):
        """Turn a body by a rotation vector (rad)."""
        s = self.s
        q = rotated_by(turn, self.bodies.turn(s, w, i))
        for k in ti.static(range(4)):
            s.orientation[w, i, k] = q[k]


class MoveOrReturn(MoveBodies):
    """This phase also keeps the configurations that are contracted, and puts bodies back to the last one."""

    @ti.func
    def change(self, w, i, before, radius):
        s = self.s
        place, far = before, ti.cast(0.0, s.real)
        if s.packing_action[w] == MOVE:
            shift, turn = self.motion(w, i)
            place = before + shift
            self.rotate(w, i, turn)
            far = turn.norm() * radius
        elif s.packing_action[w] == CONTRACT:
            s.accepted_position[w, i], s.accepted_radius[w, i] = before, radius
            for k in ti.static(range(4)):
                s.accepted_orientation[w, i, k] = s.orientation[w, i, k]
            self.rest(w, i)
        else:
            place = s.accepted_position[w, i]
            for k in ti.static(range(4)):
                s.orientation[w, i, k] = s.accepted_orientation[w, i, k]
            s.radius[w, i] = s.accepted_radius[w, i]
            self.rest(w, i)
            # Lists are rebuilt, whatever has changed since.
            far = 2.0 * radius
        return place, far

    @ti.func
    def rest(self, w, i):
        """Stop a body, in a step that does not move it."""
