"""The contract of contact laws between two particles, and between a particle and a wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Field, PairForce, Shaped
from tisim.effects.contact.granular.shape_contact import ShapeContact
from tisim.effects.contact.granular.spring import midway
from tisim.effects.contact.granular.step_limit import TRAVEL, inverse_masses, wall_inverse_masses
from tisim.effects.contact.overlapping_pairs import OverlappingPairs
from tisim.materials.material_law import MaterialLaw
from tisim.state.bound import Peers


class GranularContact(ShapeContact, MaterialLaw, PairForce):
    """A granular contact law gives the force at the point of contact of a grain with another grain or a wall.

    The law depends only on the contact: its normal, overlap, materials, the relative velocity of its
    surfaces, and its history. The point of contact lies in the middle of the overlap, R_i - delta/2 from the
    centre of i, and the force acts there. A wall is a grain of infinite radius and mass. In a scene whose
    particles have shapes, normal, overlap and point of contact are theirs (shape_contact.py).

    memory : number of history values of a contact, kept while it lasts and zero when it begins.
    turns_springs : whether the history contains vectors, which rotate with the contact.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = True
    fields = ("radius", "velocity", "spin")
    depends_on_velocity: ClassVar[bool] = True
    # Contacts begin, slip and end.
    smooth: ClassVar[bool] = False
    leapfrog: ClassVar[bool] = True
    guards_steps: ClassVar[bool] = True
    turns_springs: ClassVar[bool] = False
    shaped: ClassVar[bool] = False
    # This step control limits the approach of surfaces, but ignores the stiffness of contacts.
    incompatible_controls = ("approach_time",)

    def check_wall(
        self, start: Mapping[str, np.ndarray], effects: Sequence[Effect], material: int, label: str
    ) -> None:
        """Raise InputError unless it can act between walls of a material and the particles of a start, or
        those that effects of the scene insert."""

    def connect(self, peers: Peers) -> dict[str, Any]:
        moving = [one for one in peers.of(Shaped) if one.data.moves]
        return {"shaped": True, "shapes": moving[0]} if moving else {}

    def required_fields(self) -> tuple[str | Field, ...]:
        return (*self.fields, "material") if self.several else self.fields

    def normal_force(self, pairs: OverlappingPairs) -> np.ndarray:
        """Return the normal force (N) of each pair, as ``NormalContact.normal_force``."""
        return np.full(pairs.overlap.shape, np.inf)

    @ti.func
    def lasts(self, w, pair, overlap, radius, past):
        """Return whether the contact exists; a law that acts beyond contact also uses its history."""
        return overlap >= 0.0

    @ti.func
    def contact(self, w, pair, normal, overlap, radius, mass, inverses, slip, spinning, tilt, turn, past, dt):
        """Return the force (N) and the couple (N m) on i, and the contact history after a further dt (s),
        given the history ``past``.

        pair : index of the pair of materials (see tisim/materials/material_law.py). normal : unit vector from
        i to the other. overlap : delta (m). radius, mass : R* (m) and m* (kg), 1/R* = 1/R_i + 1/R_j.
        inverses : inverse masses, over 1/m* (see ``inverse_masses``). slip : velocity (m/s) of the surface of
        the other relative to the surface of i. spinning : spin (rad/s) of the other relative to i. tilt,
        turn : rotation of the contact in the step (see ``carried`` in spring.py), 0 unless it
        ``turns_springs``. If there is no contact the result is not used and may be NaN.
        """
        return 0.0 * normal, 0.0 * normal, past

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        force, here, there, known = 0.0 * separation, 0.0 * separation, 0.0 * separation, 0.0 * past
        if ti.static(self.shaped):
            force, here, there, known = self.between_shapes(s, w, i, j, separation, past, dt)
        else:
            force, here, there, known = self.between_spheres(s, w, i, j, separation, distance, past, dt)
        return force, here, there, known

    @ti.func
    def between_spheres(self, s, w, i, j, separation, distance, past, dt):
        """Return force, torques and history of two spheres, as ``interaction`` does."""
        a, b = s.radius[w, i], s.radius[w, j]
        overlap = a + b - distance
        arm = a - 0.5 * overlap
        nearness = 1.0 / distance
        normal = nearness * separation
        spins = arm * s.spin[w, i] + (distance - arm) * s.spin[w, j]
        passing = s.relative_velocity(w, i, j, separation)
        slip, tilt, turn = passing - spins.cross(normal), 0.0 * normal, 0.0 * distance
        if ti.static(self.turns_springs):
            # Half a step ago the distance vector of the centres was separation - dt/2 passing.
            opening, back = passing.dot(normal), 0.5 * dt * nearness
            tilt = (back + back * back * opening) * (opening * normal - passing)
            turn = 0.25 * dt * (s.spin[w, i] + s.spin[w, j]).dot(normal)
            slip = midway(slip + back * spins.cross(passing), opening, normal, tilt, turn)
        m, n, free = s.masses_behind(w, i, j)
        # R* and m* by one division, without products of masses, which underflow in f32 for small grains.
        sizes, masses = a + b, m + n
        inverse = 1.0 / (sizes * masses)
        lever, share = b * (masses * inverse), n * (sizes * inverse)
        radius, mass = a * lever, m * share
        inverses = inverse_masses(lever, share, overlap / radius, free)
        pair, spinning = self.material_pair(s, w, i, j), s.spin[w, j] - s.spin[w, i]
        # Selected afterwards rather than by a branch: several pairs are computed at once.
        force, couple, known = self.contact(
            w, pair, normal, overlap, radius, mass, inverses, slip, spinning, tilt, turn, past, dt
        )
        lasts = self.lasts(w, pair, overlap, radius, past)
        # Otherwise two grains would overlap deeply or pass each other before a force acts.
        outrun = (overlap >= 0.0) & ((free * dt * passing).norm_sqr() > (TRAVEL * ti.min(a, b)) ** 2)
        force = ti.select(outrun, ti.math.nan, force)
        force, couple = ti.select(lasts, force, 0.0), ti.select(lasts, couple, 0.0)
        # n x F has the same value for both grains.
        moment = normal.cross(force)
        back = (distance - arm) * moment - couple
        return force, arm * moment + couple, back, ti.select(lasts, known, 0.0)

    @ti.func
    def wall_reach(self, s, w, i):
        """Return the widest gap (m) at which it acts between i and a wall."""
        return 0.0 * s.radius[w, i]

    @ti.func
    def wall_pair(self, s, w, i, material):
        """Return the index of the pair of materials of i and of a wall of a material."""
        pair = 0
        if ti.static(self.several):
            pair = s.material[w, i] * self.number_of_materials + material
        return pair

    @ti.func
    def at_wall(self, s, w, i, normal, tilt, overlap, velocity, turning, material, past, dt):
        """Return force and torque of a wall on i, and the contact history.

        normal : unit vector into the wall. tilt : the direction midway in the step was normal + tilt.
        velocity : velocity of the wall surface at the contact (m/s), also midway. turning : angular velocity
        of the wall (rad/s). material : index of its material.
        """
        arm, radius = s.radius[w, i] - 0.5 * overlap, s.radius[w, i]
        pair, spin = self.wall_pair(s, w, i, material), s.spin[w, i]
        passing = velocity - s.velocity[w, i]
        slip = passing - (arm * spin).cross(normal)
        leant, turn = 0.0 * normal, 0.0 * arm
        if ti.static(self.turns_springs):
            leant, turn = tilt, 0.25 * dt * (spin + turning).dot(normal)
            slip = midway(slip - (arm * spin).cross(tilt), passing.dot(normal), normal, tilt, turn)
        mass, free = s.mass_at_wall(w, i)
        spinning, inverses = turning - spin, wall_inverse_masses(overlap / radius, free)
        force, couple, known = self.contact(
            w, pair, normal, overlap, radius, mass, inverses, slip, spinning, leant, turn, past, dt
        )
        lasts = self.lasts(w, pair, overlap, radius, past)
        outrun = (overlap >= 0.0) & (free * dt * ti.abs(slip.dot(normal)) > TRAVEL * radius)
        force = ti.select(outrun, ti.math.nan, force)
        force, couple = ti.select(lasts, force, 0.0), ti.select(lasts, couple, 0.0)
        return force, arm * normal.cross(force) + couple, ti.select(lasts, known, 0.0)
