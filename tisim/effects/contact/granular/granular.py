"""The granular contact law, which is composed of parts."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Component
from tisim.domains.domain import Domain
from tisim.effects.base import Effect, SceneParts, option
from tisim.effects.base.critical_step import (
    SLIDING,
    adhesive_contact,
    critical_step,
    elastic_contact,
    impact_stiffness,
    lagging_contact,
    smallest_grains,
)
from tisim.effects.contact.granular.cohesion_limit import check_grains, check_wall, with_inserted
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
from tisim.effects.contact.overlapping_pairs import OverlappingPairs
from tisim.errors import Words, must
from tisim.materials.material_law import MaterialLaw
from tisim.materials.materials import Touching
from tisim.numerics.vectors import piece


@ti.func
def remembered(past, begin: ti.template(), size: ti.template()):  # type: ignore[valid-type]
    """Return the history values of a part; a single unused number for a part without history."""
    return piece(past, begin, max(1, size))


class Granular(ContactGuards, GranularContact):
    """Touching grains repel each other, dissipate energy, stick, slide and roll as chosen by the parts of the
    law.

        F_n = elastic force - gamma_n v_n - cohesion
        F_t = tangential force,    M = rolling couple + twisting couple,    each up to its friction times N

    v_n is the speed at which the surfaces separate. N is |F_n| without cohesion; beside ``jkr`` and ``dmt``
    it is |F_n + 2 F_c|, with the pull-off force F_c and without damping. The point of contact lies in the
    middle of the overlap. Material properties that the parts need are given in the materials of the scene.

    With ``hertz_material``, ``restitution_damping`` and ``mindlin_force`` it is the law of Hertz and Mindlin.
    An impact at a speed v then lasts 2.94 (15 m* / (16 E* sqrt(R* v)))^(2/5). With a fiftieth of that as the
    step its restitution is accurate to 0.004.

    Steps are limited for every spring S and dashpot gamma: beyond S dt^2 + 2 gamma dt = 4 m the motion would
    oscillate and grow. The force is then not a number, and the world stops. The mass m depends on the motion.
    It is m* along the normal. For sliding it is 2/7 m*, and less if surfaces overlap by more than four radii.
    For rolling it is I*/R*^2 with 1/I* = 1/I_i + 1/I_j; for twisting, in which S is the stiffness of a
    couple, it is I*. At a wall, and for unlike grains, sliding and rolling are coupled, and the limit is that
    of the coupled motion. Mindlin's spring requires steps shorter than Hertz's by the factor sqrt(14 G*/E*),
    1.70 at nu = 0.3. Parts without friction have no limit, nor have contacts of two held bodies.

    This limit holds for an isolated pair. In rows and heaps energy grows at shorter steps already: in a row
    of n grains with undamped springs from 1 / (sqrt(2) cos(pi / (2 n))) of the limit, which is 0.72 for ten
    grains and 0.71 for many. For rigid clumps m is computed from the mass of the body, as if it were a solid
    sphere. A contact at a lever l about an axis with the moment of inertia I accelerates the body by 1/M +
    l^2/I per unit force, so that the true limit is lower by the factor sqrt(1 + M l^2/I), 1.31 at the end of
    two touching spheres.

    A world also stops if, in one step, two touching grains move relative to each other by more than the
    smaller diameter, if a grain approaches a wall by more than its diameter, or if grains may pass through
    each other or through a sheet between two checks. Below these limits the energy of an undamped impact may
    still be multiplied by up to 1 / (1 - S dt^2 / 4 m), depending on when within a step surfaces meet: 1.01
    at a thirtieth of a period.

    Springs rotate with the contact: with the normal, and about it by the mean of both spins (of grain and
    wall at a wall). Two bodies that rotate as one about any axis therefore keep their force. Springs are
    stretched by the velocity of the surfaces midway in a step, to second order in dt. With ``frame`` =
    "projected" they rotate with the normal alone and are stretched in the contact plane at the end of a step,
    as in LAMMPS. The force then stays fixed in space while both bodies spin about the normal, and grains that
    stick to a turntable creep.

    Source: the sources of its parts; M. R. Kuhn, K. Suzuki and A. Daouadji, Int. J. Numer. Methods Eng. 121
    (2020) 560, for the rotation of springs; composed as by A. P. Santos, D. S. Bolintineanu, G. S. Grest, J.
    B. Lechman, S. J. Plimpton, I. Srivastava and L. E. Silbert, Phys. Rev. E 102 (2020) 032903.
    """

    solid: ClassVar[bool] = True

    normal: NormalForce = option("elastic force along the line of centres", HertzMaterial())
    damping: Damping | None = option("damping of the normal and the tangential force", None)
    tangential: TangentialForce | None = option("friction of surfaces that slide", None)
    rolling: RollingResistance | None = option("resistance to rolling", None)
    twisting: TwistingResistance | None = option("resistance to twisting about the line of centres", None)
    cohesion: Cohesion | None = option("cohesion of surfaces that touch", None)
    frame: Literal["turning", "projected"] = option(
        "rotation of springs: with the contact normal and about it, or with the normal only as in LAMMPS",
        "turning",
    )

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        label = self.label
        wants = self.twisting is not None and self.twisting.needs_tangential
        rule = "given, as the resistance to twisting needs it"
        must(self.tangential is not None or not wants, f"{label}.tangential", rule, Words("nothing"))
        double = self.normal.adhesive and self.cohesion is not None
        rule = f"left out, as {self.normal.kind()} is adhesive itself"
        must(not double, f"{label}.cohesion", rule, self.cohesion and self.cohesion.kind())
        return self

    def approximations(self, extent: float) -> tuple[Self, ...]:
        spring: dict[str, Component | None] = {"tangential": self.tangential and LinearSpring()}
        drawn: dict[str, Component | None] = {"tangential": self.tangential and MindlinDisplacement()}
        # A linear spring does not attract, and cannot be compared with cohesion that depends on the overlap.
        linear = () if self.normal.adhesive or self.by_overlap else ({"normal": Hooke(), **spring},)
        changes = ({"rolling": None}, *linear, spring, drawn)
        tried: list[Self] = []
        for change in changes:
            law = self.model_copy(update=change)
            if law not in (self, *tried):
                tried.append(law)
        return tuple(tried)

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        if self.by_overlap:
            check_grains(self, self._materials, with_inserted(start, scene.acting()))

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        number, shortest = self.number_of_materials, math.inf
        pairs = self._materials.touching()
        for material, mass, radius in smallest_grains(start):
            # With grains of its own material, and with grains and walls of other materials.
            for pair in pairs[material * number : (material + 1) * number]:
                push = partial(self.push, pair, 0.5 * radius)
                stiffness = impact_stiffness(push, 0.5 * mass, 0.5 * radius, speed)
                sliding = self.tangential.ratio(pair) if self.tangential else 0.0
                step = critical_step(max(1.0, SLIDING * sliding) * stiffness, 0.5 * mass)
                shortest = min(shortest, step)
        return shortest if shortest > 0 else None

    def normal_force(self, pairs: OverlappingPairs) -> np.ndarray:
        radius, force = pairs.reduced_radius, np.full(pairs.overlap.shape, np.inf)
        material = np.zeros(len(pairs.state["radius"]), int)
        if self.several:
            material = pairs.state["material"].astype(int)
        kinds = material[pairs.i] * self.number_of_materials + material[pairs.j]
        for k, pair in enumerate(self._materials.touching()):
            own = kinds == k
            if own.any():
                force[own] = self.push(pair, radius[own], pairs.overlap[own])
        return force

    def push(self, pair: Touching, radius: float | np.ndarray, overlap: np.ndarray) -> np.ndarray:
        """Return the force (N) at overlaps (m), with its cohesion, at this R* (m), one or one for each."""
        pull = self.cohesion.pulls(pair, radius, overlap) if self.cohesion is not None else 0.0
        return self.normal.push(pair, radius, overlap) - pull

    def part_of_critical_step(self, accuracy: float) -> float:
        lags = (self.damping, self.tangential, self.rolling, self.twisting) != (None,) * 4
        part = lagging_contact(accuracy) if lags else elastic_contact(accuracy)
        return min(part, adhesive_contact(accuracy)) if self.adhesive else part

    def check_wall(
        self, start: Mapping[str, np.ndarray], effects: Sequence[Effect], material: int, label: str
    ) -> None:
        if self.by_overlap:
            check_wall(self, self._materials, with_inserted(start, effects), material, label)

    def failure_hint(self, effects: Sequence[Effect], domain: Domain) -> str:
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
        """Return for each part where its values begin in the history of a contact, and their number."""
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
        """Return the parts that resist sliding, rolling and twisting."""
        names = ("tangential", "rolling", "twisting")
        return [part for name, part in self.members().items() if name in names]

    @property
    def memory(self) -> int:  # type: ignore[override]
        return sum(size for _, size in self.slots().values())

    @property
    def adhesive(self) -> bool:
        """Return whether Coulomb's limit includes the pull-off force of two grains."""
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
        # Otherwise the motion would oscillate and grow, or grains would collapse into each other.
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
        """Return the history of a part after rotation with the contact: the first three values, if they are a
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
        """Return the force (N) that Coulomb's limit adds to the elastic force: twice the pull-off force, less
        the present cohesion."""
        force = 2.0 * self.normal.pull_off(w, pair, radius)
        if ti.static(self.has("cohesion")):
            force = self.cohesion.pull(w, pair, radius, overlap)
        return force
