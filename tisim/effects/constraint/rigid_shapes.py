"""Rigid bodies of given shapes: the contract of their motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.effects.base import Constraint, DerivedQuantity, Effect, Field, Force, Pairwise, SceneParts, Shaped
from tisim.effects.base.shaped import ORIENTATION, SHAPE
from tisim.effects.constraint.rigid_rotation import angular_velocity, free_rotation
from tisim.effects.contact.granular.contact import GranularContact
from tisim.effects.walls.walls import Walls
from tisim.errors import Words, must
from tisim.numerics.vectors import brought
from tisim.operators.base import AddsParticles
from tisim.shapes.particle_shape import ParticleShape

ANGULAR_MOMENTUM = Field("angular_momentum", "kg m^2/s", 3, "keep")
ORIENTATION_BEFORE = Field("orientation_before", "", 1, "keep", slots=4, scratch=True)
"""The orientation at the beginning of a step."""
LEVER_DIRECTIONS = 500
"""Directions for which the lever of a shape is computed, in one octant; the largest is right to a percent."""


class RigidShapes(Shaped, Constraint):
    """All particles are rigid bodies with shapes, and move under the forces and torques on them.

        m dv/dt = F,    dL/dt = M,    L = Q I Q^T w

    Q is the rotation by the orientation of the body, I the diagonal matrix of its principal moments of
    inertia for a uniform density. Position and velocity are integrated by velocity Verlet. The orientation is
    integrated by five rotations about principal axes between half kicks of the angular momentum L, which is
    symplectic and of second order: without torques L is constant.

    Bodies touch each other and planes by the granular contact laws of the scene. These receive the gap of the
    shapes, its normal and the point of contact; the torque is the force times its lever. ``contact_radius``
    is the radius of curvature in the laws, R* = R_i R_j/(R_i + R_j). It is constant for each body, so that an
    elastic force is the gradient of an energy. The mass m* is the mass with which both bodies together resist
    a force along the normal n at the point of contact,

        1/m* = 1/m_i + 1/m_j + (r_i x n) I_i^-1 (r_i x n) + (r_j x n) I_j^-1 (r_j x n)

    so that damping gives the restitution of the materials wherever bodies are hit. Steps are limited as for
    spheres, for m* along the normal, and for an upper bound of the mobility across it. A body whose field
    ``fixed`` is 1 stays at rest.

    Source: A. Dullweber, B. Leimkuhler, R. McLachlan, J. Chem. Phys. 107 (1997) 5840, for the rotation.
    """

    contract: ClassVar[bool] = True
    fields: ClassVar = (
        *Constraint.fields,
        *Shaped.fields,
        "fixed",
        ANGULAR_MOMENTUM,
        ORIENTATION_BEFORE,
    )
    mark: ClassVar = SHAPE.name
    free: ClassVar = True
    moves: ClassVar = True

    def held(self, start: Mapping[str, np.ndarray], domain: Domain) -> np.ndarray:
        return np.ones(len(start["mass"]), bool)

    def check(self, scene: SceneParts) -> None:
        super().check(scene)
        for effect in scene.effects:
            name, knows = f"effects.{effect.label}", isinstance(effect, GranularContact | Walls)
            if isinstance(effect, Force | Pairwise | DerivedQuantity) and not knows:
                fields = [one if isinstance(one, str) else one.name for one in effect.required_fields()]
                cut_off = isinstance(effect, Pairwise) and effect.short_ranged and not effect.truncated
                rule = f"a law for bodies with shapes, not for spheres, with effects.{self.label}"
                must("radius" not in fields and not cut_off, name, rule, effect.kind())
            rule = f"without inserted particles, with effects.{self.label}"
            must(not isinstance(effect, AddsParticles), name, rule, effect.kind())
            if isinstance(effect, Walls):
                rule = f"made of planes, spheres, and open cylinders and cones, with effects.{self.label}"
                others = ", ".join(effect.not_for_shapes())
                must(not others, name, rule, others)

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        self.check_shapes(start)
        fastest = float(np.abs(start.get("spin", np.zeros(1))).max(initial=0.0))
        most = math.sqrt(np.finfo(np.float64 if runtime.precision() == "f64" else np.float32).max)
        must(fastest < most, "particles.spin", f"below {most:.2g} rad/s, as squares must be finite", fastest)
        held = start.get("fixed", np.zeros(len(start["mass"]))) > 0
        at_rest = not start[ANGULAR_MOMENTUM.name][held].any()
        must(at_rest, "particles.spin", "0 for fixed particles", Words("a fixed particle that spins"))

    def given_at_start(self, start: Mapping[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
        given = super().given_at_start(start, seed)
        if ANGULAR_MOMENTUM.name not in start:
            number = len(start["mass"])
            turn = given.get(ORIENTATION.name, start.get(ORIENTATION.name))
            kinds = np.asarray(given.get(SHAPE.name, start.get(SHAPE.name))).astype(int)
            spin = start.get("spin", np.zeros((number, 3)))
            given[ANGULAR_MOMENTUM.name] = self._momenta({**start, SHAPE.name: kinds}, np.asarray(turn), spin)
        return given

    @np.errstate(over="ignore", invalid="ignore")
    def _momenta(self, start: Mapping[str, np.ndarray], turn: np.ndarray, spin: np.ndarray) -> np.ndarray:
        """Return the angular momenta (kg m^2/s) of bodies with spins (rad/s); zero for orientations and
        shapes that ``check_start`` refuses."""
        kinds, shapes = start[SHAPE.name], self.shapes()
        sound = len(kinds) > 0 and np.shape(turn) == (len(kinds), 4) and np.shape(spin) == (len(kinds), 3)
        sound = sound and kinds.max() < len(shapes) and bool(np.linalg.norm(turn, axis=1).all())
        if not sound:
            return np.zeros((len(kinds), 3))
        moments = np.array([one.moments() for one in shapes])[kinds]
        moments *= (start["mass"] * self.sizes(start) ** 2)[:, None]
        rotation = Rotation.from_quat(turn, scalar_first=True)
        momenta: np.ndarray = rotation.apply(moments * rotation.apply(spin, inverse=True))
        return momenta

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # The limit of a tumbling body.
        fastest = float(np.linalg.norm(start.get("spin", np.zeros((1, 3))), axis=1).max(initial=0.0))
        shortest = 2 / fastest if fastest > 0 else math.inf
        # A contact moves a body more easily than its mass alone, by a lever.
        ease = math.sqrt(1 + max(map(lever, self.shapes())))
        for law in effects:
            if isinstance(law, GranularContact):
                limit = law.critical_step(start, speed, effects)
                if limit is None:
                    return None
                shortest = min(shortest, limit / ease)
        return shortest

    @ti.func
    def holds(self, s, w, i):
        return True

    @ti.func
    def volume(self, s, w, i):
        return self.shape_volume(w, s.shape[w, i]) * self.size(s, w, i) ** 3

    @ti.func
    def moments(self, s, w, i):
        """Return the principal moments of inertia (kg m^2) of a body."""
        return s.mass[w, i] * s.radius[w, i] * s.radius[w, i] * self.inertia(s, w, i)

    @ti.func
    def balance(self, s, w, i):
        momentum, v = s.angular_momentum[w, i], s.velocity[w, i]
        spin = angular_velocity(self.turn(s, w, i), momentum, self.moments(s, w, i))
        return 0.5 * (s.mass[w, i] * v.norm_sqr() + spin.dot(momentum)), s.force[w, i].norm()

    @ti.func
    def begin(self, s, w, i):
        s.body_mass[w, i] = s.mass[w, i]
        for k in ti.static(range(4)):
            s.orientation_before[w, i, k] = s.orientation[w, i, k]

    @ti.func
    def advance(self, s, w, i, dt):
        self.kick(s, w, i, dt)
        before = self.turn(s, w, i)
        after = free_rotation(before, s.angular_momentum[w, i], self.moments(s, w, i), dt)
        for k in ti.static(range(4)):
            s.orientation_before[w, i, k], s.orientation[w, i, k] = before[k], after[k]

    @ti.func
    def kick(self, s, w, i, dt):
        if ti.static(hasattr(s, "force")):
            s.velocity[w, i] = s.velocity[w, i] + 0.5 * dt / s.mass[w, i] * s.force[w, i]
        if ti.static(hasattr(s, "torque")):
            s.angular_momentum[w, i] = s.angular_momentum[w, i] + 0.5 * dt * s.torque[w, i]

    @ti.func
    def position(self, s, w, i, t):
        # The velocity is the one midway in the step.
        dt = ti.select(t > s.time[w], s.dt[w], 0.0)
        return s.position[w, i] + ti.cast(dt, s.real) * s.velocity[w, i]

    @ti.func
    def velocity(self, s, w, i, t):
        momentum, moments = s.angular_momentum[w, i], self.moments(s, w, i)
        return s.velocity[w, i], angular_velocity(self.turn(s, w, i), momentum, moments)

    @ti.func
    def velocity_midway(self, s, w, i, t, dt):
        momentum, moments = s.angular_momentum[w, i], self.moments(s, w, i)
        return s.velocity[w, i], angular_velocity(self.midway(s, w, i, dt), momentum, moments)

    @ti.func
    def swept(self, s, w, i):
        # The chord of a rotation is at most twice the change of its quaternion.
        return 2.0 * (self.turn(s, w, i) - self.before(s, w, i)).norm() * s.radius[w, i]

    @ti.func
    def carried(self, s, w, i, vector, t, dt):
        return brought(vector, self.before(s, w, i), self.turn(s, w, i))

    @ti.func
    def before(self, s, w, i):
        """Return the orientation at the beginning of the step."""
        return ti.Vector([s.orientation_before[w, i, k] for k in ti.static(range(4))])

    @ti.func
    def midway(self, s, w, i, dt):
        """Return the orientation midway in the last step of dt (s), or now if dt is 0."""
        q = self.turn(s, w, i)
        both = q + self.before(s, w, i)
        return ti.select(dt > 0.0, 1.0 / both.norm() * both, q)

    @ti.func
    def corner(self, s, w, i, c, q, direction):
        """Return the point of corner c that is farthest along a unit vector, relative to the centre (m), for
        the orientation q. A plane touches each of the ``corners`` separately."""
        return s.radius[w, i] * direction


def lever(shape: ParticleShape) -> float:
    """Return the largest m r.K.r over all points r of the surface and all directions of a force there, with
    which a body of mass m answers a force by 1 + m r.K.r times the acceleration of its centre."""
    z = (np.arange(LEVER_DIRECTIONS) + 0.5) / LEVER_DIRECTIONS
    angle = np.pi * (np.sqrt(5) - 1) * np.arange(LEVER_DIRECTIONS)
    across = np.sqrt(1 - z * z)
    x = shape.support(np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=-1))
    moments, zero = shape.moments(), np.zeros(LEVER_DIRECTIONS)
    cross = np.array([[zero, -x[:, 2], x[:, 1]], [x[:, 2], zero, -x[:, 0]], [-x[:, 1], x[:, 0], zero]])
    cross = np.moveaxis(cross, 2, 0)
    answers = np.swapaxes(cross, 1, 2) @ (cross / moments[:, None])
    return float(np.linalg.eigvalsh(answers).max())
