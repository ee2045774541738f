"""The state of a batch of worlds, with kernel operations on particles and worlds: add, remove, fail, check
for finite values."""

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.ieee import finite
from tisim.state.state_memory import StateMemory
from tisim.state.status import ASKED, WorldStatus

HEAVY = 2.0**40
"""Factor on the mass of a fixed or prescribed particle in contacts, which makes it as heavy as a wall."""


@ti.data_oriented
class State(StateMemory):
    """A state holds all fields of a batch of worlds at one time; kernels read and write it.

    Particle fields are ``s.NAME[w, i]``. World fields: ``count`` (live particles, slots 0..count-1),
    ``time``, ``dt``, ``end`` (s, f64), ``status``, ``seed`` of the scene, ``steps`` taken, and the world
    fields that effects, steppers and step controls declare (``WorldField``).

    A long step may be made in several launches. ``underway`` is the number of particles that have not ended
    it yet. Unless it is 0, the particles have no common time: ``time`` is then the beginning of the step, and
    ``reached`` (s) a time that all particles have reached. After a failure, ``cut`` is the time into the step
    (s) up to which all was well. A step that begins with ``cut`` above 0 ends there, and so does its world.
    """

    @ti.func
    def axes(self, column: ti.template(), w):  # type: ignore[valid-type]
        """Return the three components of a world field."""
        return ti.Vector([column[w, 0], column[w, 1], column[w, 2]])

    @ti.func
    def relative_velocity(self, w, i, j, separation):
        """Return the velocity (m/s) of j relative to i, for the image of j at ``separation`` (m) from i.

        For an image that moves past the box it is not the difference of the two velocities.
        """
        return self.domain.relative_velocity(self, w, i, j, separation)

    @ti.func
    def mass_behind(self, w, i):
        """Return the effective mass (kg) of particle i in a contact: its rigid body's mass, or HEAVY times
        its own if it is fixed."""
        mass = self.mass[w, i]
        if ti.static(hasattr(self, "body_mass")):
            mass = self.body_mass[w, i]
        if ti.static(hasattr(self, "fixed")):
            mass = ti.select(self.fixed[w, i] > 0, HEAVY * self.mass[w, i], mass)
        return mass

    @ti.func
    def mass_at_wall(self, w, i):
        """Return the mass (kg) for damping in a contact of particle i with a wall, and 1.

        If i is as heavy as a wall, return its own mass and 0: the contact moves nothing, but its force is
        still computed with the mass of a particle.
        """
        mass, own = self.mass_behind(w, i), self.mass[w, i]
        held = mass >= HEAVY * own
        return ti.select(held, own, mass), ti.cast(ti.select(held, 0.0, 1.0), self.real)

    @ti.func
    def masses_behind(self, w, i, j):
        """Return the effective masses (kg) of particles i and j in a contact, and 1.

        If both are as heavy as walls, return their own masses and 0: the contact moves nothing.
        """
        m, n, own, other = self.mass_behind(w, i), self.mass_behind(w, j), self.mass[w, i], self.mass[w, j]
        both = (m >= HEAVY * own) & (n >= HEAVY * other)
        free = ti.cast(ti.select(both, 0.0, 1.0), self.real)
        return ti.select(both, own, m), ti.select(both, other, n), free

    @ti.func
    def copy(self, w, source, target):
        """Copy every field of one slot to another."""
        for field in ti.static(self.singles):
            field[w, target] = field[w, source]
        for column in ti.static(self.slotted):
            for k in range(column[1]):
                column[0][w, target, k] = column[0][w, source, k]

    @ti.func
    def remove(self, w, i):
        """Mark a particle as removed; its slot is reused after the events of this step."""
        self.mass[w, i] = 0.0
        ti.atomic_max(self.changed[w], 1)

    @ti.func
    def invalidate_lists(self, w):
        """Declare that a particle has been moved or resized other than by a step.

        It is put back into the domain, and pair lists are rebuilt.
        """
        ti.atomic_max(self.changed[w], 1)

    @ti.func
    def append(self, w, i):
        """Copy particle i to a new slot, and return its index.

        The caller must have checked ``free_slots``.
        """
        k = self.append_uncounted(w, i, 0)
        self.lengthen(w, 1)
        return k

    @ti.func
    def append_uncounted(self, w, i, k):
        """Copy particle i to the k-th slot after the last one in use, and return its index.

        The copy counts after a call of ``lengthen``. Other particles may be copied at the same time. The
        caller must have checked ``free_slots``.
        """
        new = self.count[w] + k
        self.copy(w, i, new)
        self.begin(w, new, self.next_id[w] + k)
        return new

    @ti.func
    def lengthen(self, w, number):
        """Count new particles in the slots after the last one in use."""
        self.count[w] += number
        self.next_id[w] += number
        self.changed[w] = 1

    @ti.func
    def insert(self, w, position, velocity, radius, mass):
        """Insert a new particle, with defaults in all other fields; return its index.

        The caller must have checked ``free_slots``.
        """
        k = self.count[w]
        for column in ti.static(self.defaults):
            if ti.static(column[2] == 3):
                column[0][w, k] = ti.Vector([column[1], column[1], column[1]])
            else:
                column[0][w, k] = column[1]
        self.position[w, k], self.velocity[w, k] = position, velocity
        self.radius[w, k], self.mass[w, k] = radius, mass
        for column in ti.static(self.copied):
            column[0][w, k] = column[1][w, k]
        self.begin(w, k, self.next_id[w])
        self.lengthen(w, 1)
        return k

    @ti.func
    def begin(self, w, i, number):
        """Give a new particle an id, and reset the slots that are not inherited."""
        for column in ti.static(self.slotted):
            for m in range(column[1]):
                column[0][w, i, m] = column[2]
        self.id[w, i] = number

    @ti.func
    def finish(self, w, effect):
        """End a world after this step by an effect, given by its index in the scene."""
        self.end[w] = self.time[w]
        ti.atomic_min(self.ending_effect[w], effect)

    @ti.func
    def free_slots(self, w):
        """Return the number of free slots within the capacity of the scene of a world.

        It does not depend on the capacity of the simulation, so a world ends the same way in a larger one.
        """
        return self.most[w] - self.count[w]

    @ti.func
    def fail(self, w, status, i):
        """Stop a world after this phase.

        All items of the phase finish, and the lowest id of several particles at fault is recorded, so the
        record does not depend on the order of parallel work.
        """
        ti.atomic_max(self.failed[w], status)
        ti.atomic_min(self.failing_particle[w], self.id[w, i])

    @ti.func
    def fail_by_force(self, w, status, i):
        """Stop a world by a force on particle i; failure_attribution.py later identifies the force."""
        self.fail(w, status, i)
        self.ask(w, self.time[w])

    @ti.func
    def ask(self, w, t):
        """Request the identification of the force that stopped a world, at t (s) and in the current state."""
        ti.atomic_min(self.failing_effect[w], ASKED)
        self.failure_time[w] = t

    @ti.func
    def fail_by_effect(self, w, i, effect):
        """Stop a world in which an effect, given by its index in the scene, has produced a value that is not
        finite."""
        self.fail(w, WorldStatus.NOT_FINITE, i)
        ti.atomic_min(self.failing_effect[w], effect)

    @ti.func
    def fail_world_by_effect(self, w, effect):
        """Stop a world in which an effect, given by its index in the scene, has made a world field not
        finite."""
        ti.atomic_max(self.failed[w], WorldStatus.NOT_FINITE)
        ti.atomic_min(self.failing_effect[w], effect)


@ti.data_oriented
class FiniteCheck:
    """A check on the device, for all worlds at once, that all values are finite; copying the values would
    take much longer."""

    def __init__(self, s: State) -> None:
        self.s, self.not_finite = s, ti.field(ti.i32)
        builder = Builder()
        builder.dense(ti.i, s.worlds).place(self.not_finite)
        self.tree = Tree(builder)
        fields = [field for field in s.reported if not field.integer]
        self.scalars = tuple(getattr(s, f.name) for f in fields if f.components == 1 and not f.slots)
        self.vectors = tuple(getattr(s, f.name) for f in fields if f.components == 3)
        self.slotted = tuple((getattr(s, f.name), f.slots) for f in fields if f.slots)

    @in_taichi_thread
    def finite_worlds(self) -> np.ndarray:
        """Return for each world whether all values are finite."""
        self._check_all()
        finite: np.ndarray = self.not_finite.to_numpy() == 0
        return finite

    @ti.kernel
    def _check_all(self):
        for w in range(self.s.worlds):
            self.not_finite[w] = 0
        for w, i in ti.ndrange(self.s.worlds, self.s.capacity):
            if i < self.s.count[w]:
                broken = 0
                for column in ti.static(self.scalars):
                    broken += ti.cast(not finite(column[w, i]), ti.i32)
                for column in ti.static(self.vectors):
                    for k in ti.static(range(3)):
                        broken += ti.cast(not finite(column[w, i][k]), ti.i32)
                for column in ti.static(self.slotted):
                    for k in range(column[1]):
                        broken += ti.cast(not finite(column[0][w, i, k]), ti.i32)
                if broken > 0:
                    self.not_finite[w] = 1
