"""The contract of contact laws that hold between spheres, and between a sphere and a wall."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import PairForce


class GranularContact(PairForce):
    """A granular contact gives the force at the point where a grain touches another or a wall.

    The law sees the contact only: which way it faces, how deep it is, how its surfaces move past each other,
    and what it remembers. The contact lies in the middle of the overlap, R_i - delta / 2 from the centre of
    i, and the force acts there. A wall is a grain of infinite radius and mass.

    memory : values that a contact remembers while it lasts, zero when it begins.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = True
    fields = ("radius", "velocity", "spin")
    depends_on_velocity: ClassVar[bool] = True
    # Its steps bring surfaces together and leave them there: it knows nothing of how stiff they are.
    incompatible_controls = ("approach_time",)

    @ti.func
    def contact(self, w, normal, overlap, radius, mass, slip, past, dt):
        """Return the force (N) on i, and what the contact remembers after a further dt (s), given ``past``.

        normal : unit vector from i to the other. overlap : delta (m), at least 0. radius, mass : R* (m) and
        m* (kg), 1/R* = 1/R_i + 1/R_j. slip : velocity (m/s) of the surface of the other past that of i.
        """
        return 0.0 * normal, past

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        a, b = s.radius[w, i], s.radius[w, j]
        overlap = a + b - distance
        arm = a - 0.5 * overlap
        normal = (1.0 / distance) * separation
        turn = arm * s.spin[w, i] + (distance - arm) * s.spin[w, j]
        slip = s.relative_velocity(w, i, j, separation) - turn.cross(normal)
        m, n = s.mass[w, i], s.mass[w, j]
        # R* and m*, by one division.
        sizes, masses = a + b, m + n
        inverse = 1.0 / (sizes * masses)
        radius, mass = a * b * (masses * inverse), m * n * (sizes * inverse)
        # Chosen afterwards, not by a branch: several pairs are computed at once.
        push, known = self.contact(w, normal, ti.max(overlap, 0.0), radius, mass, slip, past, dt)
        force = ti.select(overlap >= 0.0, push, 0.0)
        # n x F is the same seen from either: both turn round at once.
        couple = normal.cross(force)
        return force, arm * couple, (distance - arm) * couple, ti.select(overlap >= 0.0, known, 0.0)

    @ti.func
    def at_wall(self, s, w, i, normal, overlap, velocity, past, dt):
        """Return force and torque of a wall on i, and what the contact remembers; ``normal`` points into the
        wall, whose surface has a ``velocity`` (m/s) there."""
        arm = s.radius[w, i] - 0.5 * overlap
        slip = velocity - s.velocity[w, i] - (arm * s.spin[w, i]).cross(normal)
        force, known = self.contact(w, normal, overlap, s.radius[w, i], s.mass[w, i], slip, past, dt)
        return force, arm * normal.cross(force), known
