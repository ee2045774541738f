"""Constraints, which move particles in place of the stepper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.effects.base.effect import Effect
from tisim.effects.base.pair_event import PairEvent
from tisim.numerics.quaternions import turned
from tisim.state.fields import Field

BODY_MASS = Field("body_mass", "kg", 1, "keep", default="mass", minimum=0.0)
"""The mass of the rigid body that a particle is part of; that of the particle where it is of none."""


class Constraint(Effect):
    """A constraint holds some particles: it says where they are and how they move, in place of the stepper.

    Held particles act on others, and forces on them are summed as on any; what becomes of these forces is up
    to the constraint. No particle is held by two. A stepper that ``follows_constraints`` asks, in each step,
    each as a loop over particles: ``locate``; ``advance``; then ``position`` at the end of the step, in place
    of kick and drift, and ``velocity_midway``, as forces see free particles move too; after forces are
    summed, ``kick``; then ``velocity``. Before the first step, and after a world has been written to,
    ``begin``, ``locate``, ``position`` and ``velocity``.

    mark : the field by which it knows what it holds. free : whether bodies that it holds move by the forces
    on them, and so come to rest as particles do.
    """

    contract: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False
    leapfrog: ClassVar[bool] = True
    depends_on_velocity: ClassVar[bool] = True
    excludes: ClassVar = (PairEvent,)
    fields: ClassVar[tuple[str | Field, ...]] = ("velocity", "spin", BODY_MASS)
    mark: ClassVar[str]
    free: ClassVar[bool] = False

    def held(self, start: Mapping[str, np.ndarray], domain: Domain) -> np.ndarray:
        """Return which particles of a start in a domain it holds, shape (n,); raise InputError unless it
        can."""
        raise NotImplementedError(f"{type(self).__name__} must define held")

    def bodies(self, start: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the number of the rigid body of each particle of a start, shape (n,), and -1 where it is of
        none; as ``joined`` has them in kernels."""
        return np.full(len(start["mass"]), -1)

    def marks(self) -> str:
        """Return what its ``mark`` must be for some particles, as a message says it."""
        return "that of a body"

    @ti.func
    def holds(self, s, w, i):
        """Return whether it holds particle i."""
        return False

    @ti.func
    def joined(self, s, w, i, j):
        """Return whether i and j are parts of one rigid body: short-ranged laws do not act between them, but
        those that do so ``within_bodies``."""
        return False

    @ti.func
    def leads(self, s, w, i):
        """Return whether particle i, which it holds, stands for its body, as one particle of each does; by
        default each is a body."""
        return True

    @ti.func
    def home(self, s, w, i):
        """Return the place (m) of the body of particle i, which it holds: where that is, all of it is."""
        return s.position[w, i]

    @ti.func
    def volume(self, s, w, i):
        """Return the volume (m^3) of the body that particle i, which it holds, ``leads``; by default that of
        the particle."""
        return ti.cast(4.0 / 3.0 * ti.math.pi, s.real) * s.radius[w, i] ** 3

    @ti.func
    def balance(self, s, w, i):
        """Return kinetic energy (J) and magnitude of the force (N) of the ``free`` body that particle i
        ``leads``."""
        return 0.0 * s.mass[w, i], 0.0 * s.mass[w, i]

    @ti.func
    def begin(self, s, w, i):
        """Set what it keeps of particle i, which it holds, before the first step."""

    @ti.func
    def locate(self, s, w, i):
        """Note where in memory particle i is, which it holds: it may have moved between steps."""

    @ti.func
    def advance(self, s, w, i, dt):
        """Move on by dt (s) the body that particle i, which it holds, stands for, if it does for one: by what
        was kept of it and by the forces on its particles at the beginning of the step."""

    @ti.func
    def position(self, s, w, i, t):
        """Return the place (m) of particle i, which it holds, at time t (s, f64), at the end of a step, in
        open space: joined faces are not looked at."""
        return s.position[w, i]

    @ti.func
    def velocity(self, s, w, i, t):
        """Return velocity (m/s) and spin (rad/s) of particle i, which it holds, at time t (s, f64)."""
        return s.velocity[w, i], s.spin[w, i]

    @ti.func
    def velocity_midway(self, s, w, i, t, dt):
        """Return velocity (m/s) and spin (rad/s) of particle i, which it holds, midway in a step of dt (s)
        that ends at time t (s, f64), of which ``advance`` has been asked: those at the place midway between
        where it was and where it is."""
        return self.velocity(s, w, i, t)

    @ti.func
    def carried(self, s, w, i, vector, t, dt):
        """Return a vector that is fixed in the body of particle i, which it holds, at the end t (s, f64) of a
        step of dt (s), given what it was at the beginning; in f64. It is asked after ``velocity_midway``."""
        return turned(vector, dt * s.spin[w, i])

    @ti.func
    def kick(self, s, w, i, dt):
        """Kick the body that particle i, which it holds, stands for, by the forces at the end of a step of dt
        (s)."""
