"""The contract of contact laws that hold between spheres, and between a sphere and a wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Field, PairForce
from tisim.effects.contact.granular.spring import midway
from tisim.effects.contact.granular.step_limit import TRAVEL, inverse_masses, wall_inverse_masses
from tisim.materials.material_law import MaterialLaw


class GranularContact(MaterialLaw, PairForce):
    """A granular contact gives the force at the point where a grain touches another or a wall.

    The law sees the contact only: which way it faces, how deep it is, of which materials, how its surfaces
    move past each other, and what it remembers. The contact lies in the middle of the overlap, R_i - delta/2
    from the centre of i, and the force acts there. A wall is a grain of infinite radius and mass.

    memory : values that a contact remembers while it lasts, zero when it begins. turns_springs : whether
    some of them are vectors, which turn with the contact.
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
    # Its steps bring surfaces together and leave them there: it knows nothing of how stiff they are.
    incompatible_controls = ("approach_time",)

    def suits_wall(
        self, start: Mapping[str, np.ndarray], effects: Sequence[Effect], material: int, label: str
    ) -> None:
        """Raise InputError unless it can act between the particles of a start, or those that effects of the
        scene put in, and walls of a material."""

    def required_fields(self) -> tuple[str | Field, ...]:
        return (*self.fields, "material") if self.several else self.fields

    @ti.func
    def lasts(self, w, pair, overlap, radius, past):
        """Return whether there is a contact; a law that holds on to what parts asks what it remembers."""
        return overlap >= 0.0

    @ti.func
    def contact(self, w, pair, normal, overlap, radius, mass, inverses, slip, spinning, tilt, turn, past, dt):
        """Return the force (N) and the couple (N m) on i, and what the contact remembers after a further dt
        (s), given ``past``.

        pair : which materials touch (see tisim/materials/material_law.py). normal : unit vector from i to
        the other. overlap : delta (m). radius, mass : R* (m) and m* (kg), 1/R* = 1/R_i + 1/R_j. inverses :
        inverse masses, over 1/m* (see ``inverse_masses``). slip : velocity (m/s) of the surface of the other
        past that of i. spinning : spin (rad/s) of the other relative to i. tilt, turn : how the contact turns
        in the step (see ``carried`` in spring.py), 0 unless it ``turns_springs``. Where there is no contact
        what it returns is not used, and may be no number.
        """
        return 0.0 * normal, 0.0 * normal, past

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        a, b = s.radius[w, i], s.radius[w, j]
        overlap = a + b - distance
        arm = a - 0.5 * overlap
        nearness = 1.0 / distance
        normal = nearness * separation
        spins = arm * s.spin[w, i] + (distance - arm) * s.spin[w, j]
        passing = s.relative_velocity(w, i, j, separation)
        slip, tilt, turn = passing - spins.cross(normal), 0.0 * normal, 0.0 * distance
        if ti.static(self.turns_springs):
            # Half a step ago the centres were apart by separation - dt/2 passing.
            opening, back = passing.dot(normal), 0.5 * dt * nearness
            tilt = (back + back * back * opening) * (opening * normal - passing)
            turn = 0.25 * dt * (s.spin[w, i] + s.spin[w, j]).dot(normal)
            slip = midway(slip + back * spins.cross(passing), opening, normal, tilt, turn)
        m, n, free = s.masses_behind(w, i, j)
        # R* and m*, by one division, and by no product of masses, which of small grains is below f32.
        sizes, masses = a + b, m + n
        inverse = 1.0 / (sizes * masses)
        lever, share = b * (masses * inverse), n * (sizes * inverse)
        radius, mass = a * lever, m * share
        inverses = inverse_masses(lever, share, overlap / radius, free)
        pair, spinning = self.material_pair(s, w, i, j), s.spin[w, j] - s.spin[w, i]
        # Chosen afterwards, not by a branch: several pairs are computed at once.
        force, couple, known = self.contact(
            w, pair, normal, overlap, radius, mass, inverses, slip, spinning, tilt, turn, past, dt
        )
        lasts = self.lasts(w, pair, overlap, radius, past)
        # Else two would be deep in each other, or past each other, before either is felt.
        outrun = (overlap >= 0.0) & ((free * dt * passing).norm_sqr() > (TRAVEL * ti.min(a, b)) ** 2)
        force = ti.select(outrun, ti.math.nan, force)
        force, couple = ti.select(lasts, force, 0.0), ti.select(lasts, couple, 0.0)
        # n x F is the same seen from either: both turn round at once.
        moment = normal.cross(force)
        back = (distance - arm) * moment - couple
        return force, arm * moment + couple, back, ti.select(lasts, known, 0.0)

    @ti.func
    def wall_reach(self, s, w, i):
        """Return the widest gap (m) at which it acts between i and a wall."""
        return 0.0 * s.radius[w, i]

    @ti.func
    def at_wall(self, s, w, i, normal, tilt, overlap, velocity, turning, material, past, dt):
        """Return force and torque of a wall on i, and what the contact remembers.

        normal : unit vector into the wall. tilt : midway in the step it was along normal + tilt. velocity :
        that of its surface at the contact (m/s), midway too. turning : its angular velocity (rad/s). material
        : index of its material.
        """
        arm, radius = s.radius[w, i] - 0.5 * overlap, s.radius[w, i]
        pair, spin = 0, s.spin[w, i]
        if ti.static(self.several):
            pair = s.material[w, i] * self.number_of_materials + material
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
