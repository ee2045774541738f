"""The contact law that is composed of parts."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Component
from tisim.domains.domain import Domain
from tisim.effects.base import Effect, option
from tisim.effects.base.critical_step import (
    SLIDING,
    adhesive_contact,
    critical_step,
    elastic_contact,
    impact_stiffness,
    lagging_contact,
    smallest_grains,
)
from tisim.effects.contact.granular.cohesion_limit import check_grains, check_wall, with_newcomers
from tisim.effects.contact.granular.contact import GranularContact
from tisim.effects.contact.granular.guards import ContactGuards
from tisim.effects.contact.granular.hertz import HertzMaterial
from tisim.effects.contact.granular.hooke import Hooke
from tisim.effects.contact.granular.jump import spread
from tisim.effects.contact.granular.mindlin import LinearSpring, MindlinDisplacement
from tisim.effects.contact.granular.parts import (
    Cohesion,
    Damping,
    NormalForce,
    RollingResistance,
    TangentialForce,
    TwistingResistance,
)
from tisim.effects.contact.granular.spring import carried, midway, projected
from tisim.errors import Words, must
from tisim.materials.material_law import MaterialLaw
from tisim.materials.materials import Touching
from tisim.numerics.vectors import piece

if TYPE_CHECKING:
    from tisim.scene.scene import Scene


@ti.func
def remembered(past, begin: ti.template(), size: ti.template()):  # type: ignore[valid-type]
    """Return what is remembered for a part; for one that remembers nothing, a number that it hands back."""
    return piece(past, begin, max(1, size))


class Granular(ContactGuards, GranularContact):
    """Grains that touch push each other apart, lose energy, stick, slide and roll as the parts of it say.

        F_n = elastic force - gamma_n v_n - cohesion
        F_t, couples : of the tangential, rolling and twisting part, each up to its friction times N

    v_n is the speed at which the surfaces separate. N is |F_n| without cohesion; beside ``jkr`` and ``dmt``
    it is |F_n + 2 F_c|, with F_c the force that parts the two and without damping. The contact lies in the
    middle of the overlap. What the parts need to know of the materials that touch is in the materials of the
    scene.

    With ``hertz_material``, ``restitution_damping`` and ``mindlin_force`` it is the law of Hertz and Mindlin:
    an impact at a speed v lasts 2.94 (15 m* / (16 E* sqrt(R* v)))^(2/5), and a fiftieth of that as a step
    gives its restitution to 0.004.

    In a step beyond S dt^2 + 2 gamma dt = 4 m of any spring and dashpot what they hold would alternate and
    grow: the force is then not a number, and the world stops. The mass m is m* along the normal; of surfaces
    that slide 2/7 m*, and less where they overlap by more than four radii; I*/R*^2 of those that roll, with
    1/I* = 1/I_i + 1/I_j; and I* where S is a couple of twisting. What slides and rolls at a wall, or of
    unlike grains, moves each other, and its limit is that of both together. Mindlin's spring asks for steps
    shorter by sqrt(14 G*/E*) than Hertz's, 1.70 at nu = 0.3. Parts without friction have no limit, and two
    bodies that are both held have none. It is that of a pair by itself: in rows and heaps energy grows in
    shorter steps, in a row of n grains with undamped springs from 1 / (sqrt(2) cos(pi / (2 n))) of it on,
    0.72 for ten and 0.71 for many. Of rigid clumps the mass is that of the body, as if it were a solid
    sphere: at a lever l about an axis with the moment of inertia I a contact moves it by 1/M + l^2/I, and the
    limit falls by sqrt(1 + M l^2/I), 1.31 at the end of two spheres that touch.

    A world also stops at a step in which two that touch move past each other by more than the smaller
    diameter, a grain comes nearer a wall by more than its own, or grains may pass through each other or
    through a sheet between two looks. Below these limits an undamped impact may still come out with up to 1 /
    (1 - S dt^2 / 4 m) times its energy, by chance: 1.01 times at a thirtieth of a period.

    Springs turn with the two that touch: with the normal, and about it by the mean of both spins, at a wall
    that of grain and wall. Two that turn as one, about whichever axis, so keep the force that they had. They
    are drawn by the surfaces as these are midway in a step, to second order in dt. With ``frame`` =
    "projected" they turn with the normal alone and are drawn along that at the end of a step, as in LAMMPS:
    a force then stays in space while both turn about the normal, and what sticks to a turntable creeps.

    Source: that of its parts; M. R. Kuhn, K. Suzuki and A. Daouadji, Int. J. Numer. Methods Eng. 121 (2020)
    560, for how springs turn; composed as by A. P. Santos, D. S. Bolintineanu, G. S. Grest, J. B. Lechman, S.
    J. Plimpton, I. Srivastava and L. E. Silbert, Phys. Rev. E 102 (2020) 032903.
    """

    solid: ClassVar[bool] = True

    normal: NormalForce = option("elastic force along the line of centres", HertzMaterial())
    damping: Damping | None = option("damping, of the normal and the tangential force", None)
    tangential: TangentialForce | None = option("friction of surfaces that slide", None)
    rolling: RollingResistance | None = option("resistance to rolling", None)
    twisting: TwistingResistance | None = option("resistance to twisting about the line of centres", None)
    cohesion: Cohesion | None = option("cohesion of surfaces that touch", None)
    frame: Literal["turning", "projected"] = option(
        "how springs turn with a contact: with its normal and about it, or with its normal as in LAMMPS",
        "turning",
    )

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        label = self.label
        wants = self.twisting is not None and self.twisting.needs_tangential
        rule = "given, as the resistance to twisting goes by it"
        must(self.tangential is not None or not wants, f"{label}.tangential", rule, Words("nothing"))
        double = self.normal.adhesive and self.cohesion is not None
        rule = f"left out, as {self.normal.kind()} is adhesive itself"
        must(not double, f"{label}.cohesion", rule, self.cohesion and self.cohesion.kind())
        return self

    def approximations(self, extent: float) -> tuple[Self, ...]:
        spring: dict[str, Component | None] = {"tangential": self.tangential and LinearSpring()}
        drawn: dict[str, Component | None] = {"tangential": self.tangential and MindlinDisplacement()}
        # A spring would not pull, and is not to be held against what pulls by the overlap.
        linear = () if self.normal.adhesive or self.by_overlap else ({"normal": Hooke(), **spring},)
        changes = ({"rolling": None}, *linear, spring, drawn)
        tried: list[Self] = []
        for change in changes:
            law = self.model_copy(update=change)
            if law not in (self, *tried):
                tried.append(law)
        return tuple(tried)

    def suits_start(self, start: Mapping[str, np.ndarray], scene: "Scene") -> None:
        if self.by_overlap:
            check_grains(self, self._materials, with_newcomers(start, scene.acting()))

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        number, shortest = self.number_of_materials, math.inf
        pairs = self._materials.touching()
        for material, mass, radius in smallest_grains(start):
            # With grains of its own material, and with grains and walls of others.
            for pair in pairs[material * number : (material + 1) * number]:
                push = partial(self.push, pair, 0.5 * radius)
                stiffness = impact_stiffness(push, 0.5 * mass, 0.5 * radius, speed)
                sliding = self.tangential.ratio(pair) if self.tangential else 0.0
                step = critical_step(max(1.0, SLIDING * sliding) * stiffness, 0.5 * mass)
                shortest = min(shortest, step)
        return shortest if shortest > 0 else None

    def push(self, pair: Touching, radius: float, overlap: np.ndarray) -> np.ndarray:
        """Return the force (N) at overlaps (m), with its cohesion, at this R* (m)."""
        pull = self.cohesion.pulls(pair, radius, overlap) if self.cohesion is not None else 0.0
        return self.normal.push(pair, radius, overlap) - pull

    def part_of_critical_step(self, accuracy: float) -> float:
        lags = (self.damping, self.tangential, self.rolling, self.twisting) != (None,) * 4
        part = lagging_contact(accuracy) if lags else elastic_contact(accuracy)
        return min(part, adhesive_contact(accuracy)) if self.adhesive else part

    def suits_wall(
        self, start: Mapping[str, np.ndarray], effects: Sequence[Effect], material: int, label: str
    ) -> None:
        if self.by_overlap:
            check_wall(self, self._materials, with_newcomers(start, effects), material, label)

    def may_stop(self, effects: Sequence[Effect], domain: Domain) -> str:
        cohesion = ", or no elastic force holds the cohesion there" if self.by_overlap else ""
        long = "a step is too long for the springs and dashpots of a contact, or for how fast surfaces meet"
        return f"{long}{cohesion}"

    def members(self) -> dict[str, Component]:
        names = ("normal", "damping", "tangential", "rolling", "twisting", "cohesion")
        return {name: part for name in names if isinstance(part := getattr(self, name), MaterialLaw)}

    def has(self, name: str) -> bool:
        """Return whether it has a part."""
        return name in self.members()

    def slots(self) -> dict[str, tuple[int, int]]:
        """Return where what each part remembers begins in what a contact does, and how many values it is."""
        slots, begin = {}, 0
        for name, part in self.members().items():
            size = getattr(part, "memory", 0)
            slots[name] = (begin if size else 0, size)
            begin += size
        return slots

    @property
    def turns_springs(self) -> bool:  # type: ignore[override]
        return self.frame == "turning" and any(getattr(part, "memory", 0) for part in self.springs())

    def springs(self) -> list[Component]:
        """Return the parts that hold back a motion."""
        names = ("tangential", "rolling", "twisting")
        return [part for name, part in self.members().items() if name in names]

    @property
    def memory(self) -> int:  # type: ignore[override]
        return sum(size for _, size in self.slots().values())

    @property
    def adhesive(self) -> bool:
        """Return whether Coulomb's limit knows of the force that parts two grains."""
        return self.normal.adhesive or (self.cohesion is not None and self.cohesion.adhesive)

    @property
    def by_overlap(self) -> bool:
        """Return whether cohesion grows with the overlap."""
        return self.cohesion is not None and self.cohesion.by_overlap

    def reaches(self) -> bool:
        return self.normal.beyond_contact

    @ti.func
    def reach(self, s, w, i):
        # R* is at most half the radius of the larger grain.
        return self.normal.reach(w, 0.5 * s.radius[w, i])

    @ti.func
    def wall_reach(self, s, w, i):
        gap = ti.cast(0.0, s.real)
        if ti.static(self.normal.beyond_contact):
            gap = self.normal.reach(w, s.radius[w, i])
        return gap

    @ti.func
    def lasts(self, w, pair, overlap, radius, past):
        touches = overlap >= 0.0
        if ti.static(self.normal.beyond_contact):
            held = (past[0] > 0.0) & (overlap >= -self.normal.separation_gap(w, pair, radius))
            touches = touches | held
        return touches

    @ti.func
    def contact(self, w, pair, normal, overlap, radius, mass, inverses, slip, spinning, tilt, turn, past, dt):
        known, couple, opening = 0.0 * past, 0.0 * normal, slip.dot(normal)
        deep = overlap
        if ti.static(not self.normal.beyond_contact):
            deep = ti.max(overlap, 0.0)
        circle = self.normal.circle(w, pair, radius, deep)
        stiffness = self.normal.stiffness(w, pair, circle)
        elastic = self.normal.elastic(w, pair, radius, deep, circle)
        damping = 0.0 * stiffness
        if ti.static(self.has("damping")):
            damping = self.damping.coefficient(w, pair, stiffness, mass, self.normal.restitution_factor)
        press = elastic - damping * opening
        spring, dashpot, friction = 0.0 * stiffness, 0.0 * stiffness, 0.0 * stiffness
        if ti.static(self.has("tangential")):
            spring = self.tangential.spring(w, pair, stiffness)
            dashpot = self.tangential.dashpot(w, pair, damping)
            friction = self.tangential.coulomb(w, pair)
        # Else what moves would alternate and grow, or what touches fall into each other.
        follows = self.steps_follow(
            w, pair, circle, radius, mass, inverses, stiffness, damping, spring, dashpot, friction, dt
        )
        press = ti.select(follows & self.holds_apart(w, pair, radius), press, ti.math.nan)
        limit = ti.abs(press)
        if ti.static(self.adhesive):
            limit = ti.abs(elastic + self.adhesion(w, pair, radius, deep))
        if ti.static(self.has("cohesion")):
            pull = self.cohesion.pull(w, pair, radius, deep)
            if ti.static(self.cohesion.jumps):
                pull *= spread(deep, ti.abs(opening), dt, pull, mass)
            press -= pull
        if ti.static(self.normal.memory > 0):
            jump, begun = self.normal.spread_jumps(w, pair, radius, mass, overlap, opening, past[0], dt)
            press += jump
            known[0] = begun
        force = -press * normal

        if ti.static(self.has("tangential")):
            begin, size = ti.static(self.slots()["tangential"])
            held = self.turned(remembered(past, begin, size), normal, tilt, turn, self.tangential.vector)
            sliding = slip - opening * normal
            grip, kept = self.tangential.force(w, pair, normal, stiffness, damping, limit, sliding, held, dt)
            force += grip
            for k in ti.static(range(size)):
                known[begin + k] = kept[k]
        if ti.static(self.has("rolling")):
            first, length = ti.static(self.slots()["rolling"])
            bent = self.turned(remembered(past, first, length), normal, tilt, turn, self.rolling.vector)
            rolling = radius * spinning.cross(normal)
            if ti.static(self.turns_springs):
                rolling = midway(radius * spinning.cross(normal + tilt), 0.0, normal, tilt, turn)
            roll, left = self.rolling.force(w, pair, normal, stiffness, mass, limit, rolling, bent, dt)
            couple += radius * normal.cross(roll)
            for k in ti.static(range(length)):
                known[first + k] = left[k]
        if ti.static(self.has("twisting")):
            start, extent = ti.static(self.slots()["twisting"])
            twist, wound = self.twisting.couple(
                w, pair, circle, spring, dashpot, friction, limit, spinning.dot(normal + tilt),
                remembered(past, start, extent), dt,
            )  # fmt: skip
            couple += twist * normal
            for k in ti.static(range(extent)):
                known[start + k] = wound[k]
        return force, couple, known

    @ti.func
    def turned(self, past, normal, tilt, turn, vector: ti.template()):  # type: ignore[valid-type]
        """Return what a part remembers as it turns with the contact: the first three values where they are a
        vector."""
        known = past
        if ti.static(vector):
            held = piece(past, 0, 3)
            if ti.static(self.turns_springs):
                held = carried(held, normal, tilt, turn)
            else:
                held = projected(held, normal)
            for axis in ti.static(range(3)):
                known[axis] = held[axis]
        return known

    @ti.func
    def adhesion(self, w, pair, radius, overlap):
        """Return what Coulomb's limit adds to the elastic force (N): twice the force that parts the two, less
        what pulls already."""
        force = 2.0 * self.normal.pull_off(w, pair, radius)
        if ti.static(self.has("cohesion")):
            force = self.cohesion.pull(w, pair, radius, overlap)
        return force
