"""Constraints, which move particles in place of the stepper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.effects.base.effect import Effect
from tisim.effects.base.pair_event import PairEvent
from tisim.numerics.vectors import turned
from tisim.state.fields import Field

BODY_MASS = Field("body_mass", "kg", 1, "keep", default="mass", minimum=0.0)
"""The mass of the rigid body that a particle is part of; its own mass if it is part of none."""


class Constraint(Effect):
    """A constraint holds some particles: it sets their positions and velocities in place of the stepper.

    Held particles act on others, and forces on them are summed as usual; the constraint decides how these
    forces are used. A particle is held by at most one constraint. In each step a stepper that
    ``follows_constraints`` calls, each in a loop over particles: ``locate``; ``advance``; at the end of the
    step ``position``, in place of kick and drift; ``velocity_midway``, since forces also see free particles
    at their midway velocities; after forces are summed, ``kick``; then ``velocity``. Before the first step,
    and after a world has been written to, it calls ``begin``, ``locate``, ``position`` and ``velocity``.

    mark : the field that identifies held particles. free : whether the forces on held bodies move them, so
    that they can come to rest as particles do.
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
        """Return which particles of a start in a domain it holds, shape (n,); raise InputError if it cannot
        hold them."""
        raise NotImplementedError(f"{type(self).__name__} must define held")

    def bodies(self, start: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the number of the rigid body of each particle of a start, shape (n,), -1 for particles of no
        body; must agree with ``joined`` in kernels."""
        return np.full(len(start["mass"]), -1)

    def marks(self) -> str:
        """Return the value of ``mark`` that some particles must have, as worded in a message."""
        return "that of a body"

    @ti.func
    def holds(self, s, w, i):
        """Return whether it holds particle i."""
        return False

    @ti.func
    def joined(self, s, w, i, j):
        """Return whether i and j are parts of one rigid body. Short-ranged laws do not act between them
        unless they set ``within_bodies``."""
        return False

    @ti.func
    def leads(self, s, w, i):
        """Return whether held particle i represents its body; exactly one particle of each body does. By
        default each particle is a body."""
        return True

    @ti.func
    def home(self, s, w, i):
        """Return the reference position (m) of the body of held particle i; regions use it for the body as a
        whole."""
        return s.position[w, i]

    @ti.func
    def volume(self, s, w, i):
        """Return the volume (m^3) of the body that held particle i ``leads``; by default the volume of the
        particle."""
        return ti.cast(4.0 / 3.0 * ti.math.pi, s.real) * s.radius[w, i] ** 3

    @ti.func
    def balance(self, s, w, i):
        """Return kinetic energy (J) and magnitude of the force (N) of the ``free`` body that particle i
        ``leads``."""
        return 0.0 * s.mass[w, i], 0.0 * s.mass[w, i]

    @ti.func
    def begin(self, s, w, i):
        """Initialise the state variables of held particle i before the first step."""

    @ti.func
    def locate(self, s, w, i):
        """Record the index of held particle i, which may have changed between steps."""

    @ti.func
    def advance(self, s, w, i, dt):
        """Advance the body by dt (s) if held particle i leads it, from its state and the forces on its
        particles at the beginning of the step."""

    @ti.func
    def position(self, s, w, i, t):
        """Return the position (m) of held particle i at time t (s, f64), the end of a step; unwrapped,
        without regard to periodic faces."""
        return s.position[w, i]

    @ti.func
    def velocity(self, s, w, i, t):
        """Return velocity (m/s) and spin (rad/s) of held particle i at time t (s, f64)."""
        return s.velocity[w, i], s.spin[w, i]

    @ti.func
    def velocity_midway(self, s, w, i, t, dt):
        """Return velocity (m/s) and spin (rad/s) of held particle i midway in a step of dt (s) that ends at
        time t (s, f64), at the position midway between the positions before and after the step. It is called
        after ``advance``."""
        return self.velocity(s, w, i, t)

    @ti.func
    def swept(self, s, w, i):
        """Return by how much (m) points of held particle i may have moved in a step by its rotation, if it is
        not a sphere. It is called after ``advance``."""
        return 0.0 * s.radius[w, i]

    @ti.func
    def carried(self, s, w, i, vector, t, dt):
        """Return, at the end t (s, f64) of a step of dt (s), a vector that is fixed in the body of held
        particle i, given the vector at the beginning; in f64. It is called after ``velocity_midway``."""
        return turned(vector, dt * s.spin[w, i])

    @ti.func
    def kick(self, s, w, i, dt):
        """Kick the body by the forces at the end of a step of dt (s), if held particle i leads it."""
