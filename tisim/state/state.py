"""The state of a batch of worlds, with what kernels do to whole particles and worlds: add, remove, fail; and
whether all of it is finite."""

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.ieee import finite
from tisim.state.state_memory import StateMemory
from tisim.state.status import ASKED, WorldStatus

HEAVY = 2.0**40
"""A particle that is fixed or moves as prescribed counts in contacts as so many times as heavy as it is: as a
wall."""


@ti.data_oriented
class State(StateMemory):
    """A state is all that a batch of worlds is at a time; kernels read and write it.

    Particle fields are ``s.NAME[w, i]``. World fields: ``count`` (live particles, slots 0..count-1),
    ``time``, ``dt``, ``end`` (s, f64), ``status``, ``seed`` of the scene, ``steps`` taken, and the counters
    (i64), quantities (f64) and flags (i32) that effects and steppers declare.

    A step that takes long may be made in several launches. ``underway`` is the number of particles that have
    not ended it yet: unless that is 0 the particles have no time in common, ``time`` is that of when the step
    began, and ``reached`` (s) one that all have got to. ``cut`` is how far into such a step all was well (s),
    when it has failed; a step that begins with ``cut`` above 0 ends there, and its world does.
    """

    @ti.func
    def axes(self, column: ti.template(), w):  # type: ignore[valid-type]
        """Return the three components of a world quantity."""
        return ti.Vector([column[w, 0], column[w, 1], column[w, 2]])

    @ti.func
    def relative_velocity(self, w, i, j, separation):
        """Return the velocity (m/s) of j, as i sees it at ``separation`` (m), relative to i; of an image that
        moves past the box it is not the difference of the two velocities."""
        return self.domain.relative_velocity(self, w, i, j, separation)

    @ti.func
    def mass_behind(self, w, i):
        """Return the mass (kg) that a contact of particle i meets: that of its rigid body, where it is part
        of one; HEAVY times its own, where it is fixed."""
        mass = self.mass[w, i]
        if ti.static(hasattr(self, "body_mass")):
            mass = self.body_mass[w, i]
        if ti.static(hasattr(self, "fixed")):
            mass = ti.select(self.fixed[w, i] > 0, HEAVY * self.mass[w, i], mass)
        return mass

    @ti.func
    def mass_at_wall(self, w, i):
        """Return the mass (kg) that damps a contact of particle i with a wall, and 1; where i is as heavy as
        a wall itself its own mass, as the force on either is that of a particle, and 0: nothing moves by
        it."""
        mass, own = self.mass_behind(w, i), self.mass[w, i]
        held = mass >= HEAVY * own
        return ti.select(held, own, mass), ti.cast(ti.select(held, 0.0, 1.0), self.real)

    @ti.func
    def masses_behind(self, w, i, j):
        """Return the masses (kg) that a contact of particles i and j meets, and 1; where both are as heavy as
        walls their own masses, and 0: nothing moves by the contact."""
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
        """Mark a particle as gone; its slot is reused after the events of this step."""
        self.mass[w, i] = 0.0
        ti.atomic_max(self.changed[w], 1)

    @ti.func
    def invalidate_lists(self, w):
        """Say that a particle has been moved or resized other than by a step: it is put back into the domain,
        and pair lists are made anew."""
        ti.atomic_max(self.changed[w], 1)

    @ti.func
    def append(self, w, i):
        """Copy particle i to a new slot, and return its index. The caller has checked ``room``."""
        k = self.append_uncounted(w, i, 0)
        self.lengthen(w, 1)
        return k

    @ti.func
    def append_uncounted(self, w, i, k):
        """Copy particle i to the k-th slot after the last one in use, and return its index; it counts from
        ``lengthen`` on. Others may be copied at the same time. The caller has checked ``room``."""
        new = self.count[w] + k
        self.copy(w, i, new)
        self.begin(w, new, self.next_id[w] + k)
        return new

    @ti.func
    def lengthen(self, w, number):
        """Count so many new particles, in the slots after the last one in use."""
        self.count[w] += number
        self.next_id[w] += number
        self.changed[w] = 1

    @ti.func
    def insert(self, w, position, velocity, radius, mass):
        """Put a new particle in, with what all fields start with besides; return its index. The caller has
        checked ``room``."""
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
        """Give a new particle an id, and nothing that is its own yet."""
        for column in ti.static(self.slotted):
            for m in range(column[1]):
                column[0][w, i, m] = column[2]
        self.id[w, i] = number

    @ti.func
    def finish(self, w, effect):
        """Have a world end after this step, by an effect, by its index in the scene."""
        self.end[w] = self.time[w]
        ti.atomic_min(self.ending_effect[w], effect)

    @ti.func
    def room(self, w):
        """Return the number of free slots, of those that its scene has, so that no world ends otherwise in a
        larger simulation."""
        return self.most[w] - self.count[w]

    @ti.func
    def fail(self, w, status, i):
        """Stop a world, after this phase: all of its items are heard, and of several particles at fault the
        lowest id is recorded, whatever the order of parallel work."""
        ti.atomic_max(self.failed[w], status)
        ti.atomic_min(self.failing_particle[w], self.id[w, i])

    @ti.func
    def fail_by_force(self, w, status, i):
        """Stop a world by a force on particle i; failure_attribution.py finds out which of them it was."""
        self.fail(w, status, i)
        self.ask(w, self.time[w])

    @ti.func
    def ask(self, w, t):
        """Ask which force it was that stopped a world, at t (s) and as the world is now."""
        ti.atomic_min(self.failing_effect[w], ASKED)
        self.failure_time[w] = t

    @ti.func
    def fail_by_effect(self, w, i, effect):
        """Stop a world in which an effect, by its index in the scene, has made something not finite."""
        self.fail(w, WorldStatus.NOT_FINITE, i)
        ti.atomic_min(self.failing_effect[w], effect)

    @ti.func
    def fail_world_by_effect(self, w, effect):
        """Stop a world in which an effect, by its index in the scene, has made a quantity of the world not
        finite."""
        ti.atomic_max(self.failed[w], WorldStatus.NOT_FINITE)
        ti.atomic_min(self.failing_effect[w], effect)


@ti.data_oriented
class FiniteCheck:
    """This check asks for all worlds of a state at once whether all is finite; a copy of all quantities would
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
        """Return whether all is finite, by world."""
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
