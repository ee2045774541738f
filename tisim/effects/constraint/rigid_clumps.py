"""Rigid clumps of spheres, which move as bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.effects.base import Constraint, Effect, Field, PairForce, SceneParts
from tisim.effects.constraint.clump_fields import (
    BODY,
    BODY_BEFORE,
    MEMBERSHIP,
    NO_CLUMP,
    check_clumps,
    longest_clump,
)
from tisim.effects.constraint.rigid_rotation import angular_velocity, free_rotation
from tisim.errors import must
from tisim.numerics.vectors import brought, rotated
from tisim.operators.base import largest_inserted

INDEX = Field("clump_index", "", 1, "keep", integer=True, scratch=True, lookup=True)
"""Slot k holds the present index of clump member number k; it does not describe the particle that occupies
the slot."""


class RigidClumps(Constraint):
    """Clumps of spheres move as rigid bodies under the total force and torque on their spheres.

        M dV/dt = sum_i f_i,    dL/dt = sum_i ((r_i - X) x f_i + t_i),    v_i = V + w x (r_i - X)

    A start with clumps is made by ``Particles.of_clumps``. The spheres are ordinary particles otherwise. Laws
    act on each sphere; short-ranged laws other than dipole laws do not act between spheres of one clump. In
    granular contacts the mass is the mass of the body. The centre of mass is integrated by velocity Verlet.
    The rotation is integrated by five rotations about principal axes between half kicks of the angular
    momentum, which is symplectic and of second order. Permanent moments rotate with the body. Sums are in the
    order of the members.

    ``tisim.analysis.clump_bodies`` returns the positions and velocities of the bodies of a Result.

    Source: A. Dullweber, B. Leimkuhler, R. McLachlan, J. Chem. Phys. 107 (1997) 5840.
    """

    fields: ClassVar = (*Constraint.fields, *MEMBERSHIP, *BODY, BODY_BEFORE, INDEX)
    mark: ClassVar = "clump"
    free: ClassVar = True

    def held(self, start: Mapping[str, np.ndarray], domain: Domain) -> np.ndarray:
        if not len(start["mass"]):
            return np.zeros(0, bool)
        check_clumps(start, domain)
        held: np.ndarray = start["clump"] != NO_CLUMP
        return held

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        domain, effects = scene.domain, scene.acting()
        (low, high), imaged = domain.bounds(), np.array(domain.imaged())
        touching = any(isinstance(effect, PairForce) and effect.short_ranged for effect in effects)
        if low is None or high is None or not imaged.any() or not touching:
            return
        later = largest_inserted(effects)
        own = longest_clump(start) if len(start["mass"]) else 0.0
        lengths = np.concatenate([[own], later["length"]])
        radii = np.concatenate([start["radius"], later["radius"]])
        # Another particle may touch both of its ends, one of them in an image.
        taken = float(lengths.max() + 2 * radii.max(initial=0.0))
        rule = f"at least {taken:g} m wide where it is periodic, longest clump plus largest diameter"
        must(not (imaged & (high - low < taken)).any(), domain.label, rule, (high - low).tolist())

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # The limit of a tumbling body; the forces on it give their own limits.
        fastest = float(np.linalg.norm(start.get("spin", np.zeros((1, 3))), axis=1).max(initial=0.0))
        return 2 / fastest if fastest > 0 else math.inf

    def bodies(self, start: Mapping[str, np.ndarray]) -> np.ndarray:
        return start.get("clump", np.full(len(start["mass"]), NO_CLUMP))

    @ti.func
    def holds(self, s, w, i):
        return s.clump[w, i] != NO_CLUMP

    @ti.func
    def joined(self, s, w, i, j):
        return s.clump[w, i] != NO_CLUMP and s.clump[w, i] == s.clump[w, j]

    @ti.func
    def locate(self, s, w, i):
        s.clump_index[w, s.clump_member[w, i]] = i

    @ti.func
    def leads(self, s, w, i):
        # The first member of a clump holds the fields of the body.
        return s.clump_member[w, i] == s.clump_first[w, i]

    @ti.func
    def home(self, s, w, i):
        return s.clump_position[w, s.clump_index[w, s.clump_first[w, i]]]

    @ti.func
    def volume(self, s, w, i):
        return s.clump_volume[w, i]

    @ti.func
    def balance(self, s, w, i):
        force, _torque = self.load(s, w, i)
        momentum, v = s.clump_angular_momentum[w, i], s.clump_velocity[w, i]
        spin = angular_velocity(self.orientation(s, w, i), momentum, s.clump_inertia[w, i])
        return 0.5 * (s.body_mass[w, i] * v.norm_sqr() + spin.dot(momentum)), force.norm()

    @ti.func
    def orientation(self, s, w, i):
        """Return the quaternion of the body that i leads."""
        return ti.Vector([s.clump_orientation[w, i, k] for k in ti.static(range(4))])

    @ti.func
    def advance(self, s, w, i, dt):
        if self.leads(s, w, i):
            self.kick(s, w, i, dt)
            place = s.clump_position[w, i] + dt * s.clump_velocity[w, i]
            s.clump_position[w, i] = s.domain.wrap(w, place, s.time[w])
            momentum, moments = s.clump_angular_momentum[w, i], s.clump_inertia[w, i]
            before = self.orientation(s, w, i)
            after = free_rotation(before, momentum, moments, dt)
            for k in ti.static(range(4)):
                s.clump_orientation_before[w, i, k], s.clump_orientation[w, i, k] = before[k], after[k]

    @ti.func
    def kick(self, s, w, i, dt):
        if self.leads(s, w, i):
            force, torque = self.load(s, w, i)
            s.clump_velocity[w, i] = s.clump_velocity[w, i] + 0.5 * dt / s.body_mass[w, i] * force
            s.clump_angular_momentum[w, i] = s.clump_angular_momentum[w, i] + 0.5 * dt * torque

    @ti.func
    def load(self, s, w, i):
        """Return force (N) and torque (N m), about the centre of mass, on the body that i leads."""
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        if ti.static(hasattr(s, "force")):
            q, first = self.orientation(s, w, i), s.clump_first[w, i]
            for member in range(first, first + s.clump_size[w, i]):
                j = s.clump_index[w, member]
                force += s.force[w, j]
                torque += rotated(q, s.clump_offset[w, j]).cross(s.force[w, j])
                if ti.static(hasattr(s, "torque")):
                    torque += s.torque[w, j]
        return force, torque

    @ti.func
    def position(self, s, w, i, t):
        leader = s.clump_index[w, s.clump_first[w, i]]
        return s.clump_position[w, leader] + rotated(self.orientation(s, w, leader), s.clump_offset[w, i])

    @ti.func
    def velocity(self, s, w, i, t):
        leader = s.clump_index[w, s.clump_first[w, i]]
        q = self.orientation(s, w, leader)
        spin = angular_velocity(q, s.clump_angular_momentum[w, leader], s.clump_inertia[w, leader])
        return s.clump_velocity[w, leader] + spin.cross(rotated(q, s.clump_offset[w, i])), spin

    @ti.func
    def carried(self, s, w, i, vector, t, dt):
        leader = s.clump_index[w, s.clump_first[w, i]]
        before = ti.Vector([s.clump_orientation_before[w, leader, k] for k in ti.static(range(4))])
        return brought(vector, before, self.orientation(s, w, leader))

    @ti.func
    def velocity_midway(self, s, w, i, t, dt):
        leader, half = s.clump_index[w, s.clump_first[w, i]], 0.5 * dt
        q, momentum = self.orientation(s, w, leader), s.clump_angular_momentum[w, leader]
        moments, arm = s.clump_inertia[w, leader], rotated(q, s.clump_offset[w, i])
        spin = angular_velocity(q, momentum, moments)
        # The body rotates freely, dw/dt = -I^-1 (w x L). The arm a midway in the step follows from the arm at
        # its end, which is a + turn x a.
        spin += half * angular_velocity(q, spin.cross(momentum), moments)
        turn = half * spin
        arm = (arm - turn.cross(arm) + turn.dot(arm) * turn) / (1.0 + turn.norm_sqr())
        return s.clump_velocity[w, leader] + spin.cross(arm), spin
