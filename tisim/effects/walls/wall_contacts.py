"""The forces of a wall on the grains that touch it, and the contact history."""

from typing import TYPE_CHECKING, Any

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.spring import tilted
from tisim.effects.walls.curved_walls import CurvedWalls
from tisim.effects.walls.wall_ring import WallRing
from tisim.effects.walls.wall_search import CONTACTS, WallSearch

STILL_THE_SAME = 0.9
"""Smallest cosine between the directions of a contact in successive steps; the closest match continues."""
CAUTION = 1e-6
"""Clearances are reduced by this fraction of the lengths from which they are computed, to allow for
rounding."""


class WallContacts(CurvedWalls, WallRing, WallSearch):
    """Wall contacts compute the forces of a bound wall on the grains that touch it.

    laws : each contact law with the position of its values in the history of a contact, and their number;
    stride : the number of all values. shapes : the shapes of particles that are ``shaped``; corners : the
    number of points of a particle that touch a plane separately. kept : the state of the motion. The other
    attributes are the fields of tisim/effects/walls/walls.py that hold the history on the grains.
    """

    if TYPE_CHECKING:
        laws: Any
        stride: Any
        wall_material: Any
        motion: Any
        kept: Any
        has_planes: Any
        past: Any
        surface_past: Any
        touched: Any
        clear: Any
        loads: Any
        shaped: Any
        shapes: Any
        corners: Any
        resistance: Any
        touches_surfaces: Any

    @ti.func
    def load(self, s, w, i, t, dt, commit):
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        # Most grains touch no wall and touched none in the step before.
        if self.may_touch(s, w, i, t):
            touching, before = 0, self.touched[w, i]
            r = self.motion.to_body(self.kept, w, s.position[w, i], t)
            if ti.static(self.has_planes):
                for k in range(self.flat.size(w)):
                    touching += ti.select(self.flat.distance(w, k, r) <= self.reach(s, w, i), 1, 0)
                if touching + before > 0:
                    for k in range(self.flat.size(w)):
                        push, turn = self.touch_plane(s, w, i, k, r, t, dt, commit)
                        force, torque = force + push, torque + turn
            if ti.static(self.touches_surfaces or self.motion.moves):
                clear = self.from_planes(w, r)
                if ti.static(self.touches_surfaces and self.shaped):
                    push, turn, number, beside = self.touch_envelopes(s, w, i, r, before, t, dt, commit)
                    force, torque, touching = force + push, torque + turn, touching + number
                    clear = ti.min(clear, beside)
                    if touching == 0 and self.may_have_passed(s, w, i, beside, t, dt):
                        force[0] = ti.math.nan
                elif ti.static(self.touches_surfaces):
                    number, found, beside = self.contacts(s, w, i, r, self.reach(s, w, i))
                    push, turn = self.touch_surfaces(s, w, i, number + before, number, found, t, dt, commit)
                    force, torque, touching = force + push, torque + turn, touching + number
                    clear = ti.min(clear, beside)
                    if touching == 0 and self.may_have_passed(s, w, i, beside, t, dt):
                        force[0] = ti.math.nan
                if commit:
                    self.note_clearance(s, w, i, ti.select(touching > 0, 0.0, clear), t)
            if commit and touching + before > 0:
                self.touched[w, i] = touching
                for axis in ti.static(range(3)):
                    self.loads[w, i, axis], self.loads[w, i, 3 + axis] = force[axis], torque[axis]
                if ti.static(len(self.motion.quantities) > 0):
                    ti.atomic_add(self.resistance[w], self.motion.resistance(w, force))
        return force, torque

    @ti.func
    def end_step(self, s, w):
        if ti.static(len(self.motion.quantities) > 0):
            self.motion.end_step(self.kept, w, self.resistance[w], s.time[w])
            self.resistance[w] = 0

    @ti.func
    def reach(self, s, w, i):
        """Return the interaction range (m) of a wall from the centre of grain i: mostly the radius of i."""
        gap = ti.cast(0.0, s.real)
        for law in ti.static(self.laws):
            gap = ti.max(gap, law[0].wall_reach(s, w, i))
        return s.radius[w, i] + gap

    @ti.func
    def may_touch(self, s, w, i, t):
        """Return whether grain i may touch the wall, given its cached clearance and its motion since then."""
        near = True
        if ti.static(self.touches_surfaces or self.motion.moves):
            seen = ti.Vector([self.clear[w, i, axis] for axis in ti.static(range(3))])
            moved = (s.position[w, i] - seen).norm() + self.clear[w, i, 4] * ti.cast(t, s.real)
            near = moved + self.reach(s, w, i) >= self.clear[w, i, 3]
        return near

    @ti.func
    def may_have_passed(self, s, w, i, beside, t, dt):
        """Return whether grain i may have passed through a sheet in this step. ``beside`` (m) is its distance
        from sheets that it does not touch. A path shorter than the interaction range would be detected as a
        contact."""
        at = s.position[w, i]
        path = dt * (s.velocity[w, i] - self.motion.velocity_at(self.kept, w, at, t)).norm()
        return (path > self.reach(s, w, i)) & (path > beside)

    @ti.func
    def note_clearance(self, s, w, i, clear, t):
        """Cache a lower bound ``clear`` (m) of the distance of grain i from the wall, and the speed of the
        wall."""
        r = s.position[w, i]
        speed = self.motion.fastest(w, r, clear)
        until = clear + speed * ti.cast(t, s.real)
        for axis in ti.static(range(3)):
            self.clear[w, i, axis] = r[axis]
        self.clear[w, i, 3] = until - CAUTION * (until + r.norm())
        self.clear[w, i, 4] = speed

    @ti.func
    def touch(self, s, w, i, law: ti.template(), outward, before, distance, past, t, dt):  # type: ignore[valid-type]
        """Return force (N), torque (N m) and history of a contact at a ``distance`` (m) from the centre, in
        the direction ``outward`` of the body frame; a step ago the contact was in the direction ``before`` in
        space."""
        normal = -self.motion.to_space(self.kept, w, outward, t)
        overlap, turning = s.radius[w, i] - distance, self.motion.angular_velocity(w)
        arm, tilt = s.radius[w, i] - 0.5 * overlap, tilted(-before, normal)
        velocity = 0.0 * normal
        if ti.static(self.motion.moves):
            # Midway in the step, like the velocity of a grain.
            place = s.position[w, i] - 0.5 * dt * s.velocity[w, i] + arm * (normal + tilt)
            velocity = self.motion.velocity_at(self.kept, w, place, t - 0.5 * ti.cast(dt, ti.f64))
        return law.at_wall(s, w, i, normal, tilt, overlap, velocity, turning, self.wall_material, past, dt)

    @ti.func
    def moved_back(self, w, direction, dt):
        """Return a direction in space that rotates with the body as it was a step of dt (s) ago."""
        before = direction
        if ti.static(self.motion.moves):
            before -= dt * self.motion.angular_velocity(w).cross(direction)
        return before

    @ti.func
    def touch_plane(self, s, w, i, k, r, t, dt, commit):
        """Return force (N) and torque (N m) at plane k; the contact history is updated if ``commit``."""
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        distance = self.flat.distance(w, k, r)
        for law, first, size in ti.static(self.laws):
            for corner in ti.static(range(self.corners)):
                past = ti.Vector.zero(s.real, max(1, size))
                begin = (k * self.corners + corner) * self.stride + first
                for c in ti.static(range(size)):
                    past[c] = self.past[w, i, begin + c]
                known = 0.0 * past
                if distance <= self.reach(s, w, i):
                    outward = self.flat.direction(w, k)
                    now = self.motion.to_space(self.kept, w, outward, t)
                    before, push, turn = self.moved_back(w, now, dt), 0.0 * force, 0.0 * force
                    if ti.static(self.shaped):
                        push, turn, known = self.touch_corner(
                            s, w, i, law, corner, now, before, distance, past, t, dt
                        )
                    else:
                        push, turn, known = self.touch(s, w, i, law, outward, before, distance, past, t, dt)
                    force, torque = force + push, torque + turn
                if commit:
                    for c in ti.static(range(size)):
                        self.past[w, i, begin + c] = known[c]
        return force, torque

    @ti.func
    def touch_corner(self, s, w, i, law: ti.template(), corner, outward, before, distance, past, t, dt):  # type: ignore[valid-type]
        """Return force (N), torque (N m) and history of a contact of one corner of a shape with a plane at a
        ``distance`` (m) from the centre. ``outward`` is the normal of the plane in space, towards the
        particles, ``before`` a step ago."""
        normal, turning = -outward, self.motion.angular_velocity(w)
        tilt = tilted(-before, normal)
        x = self.shapes.corner(s, w, i, corner, self.shapes.turn(s, w, i), normal)
        overlap, leant = x.dot(normal) - distance, (normal + tilt).normalized()
        arm = x - 0.5 * overlap * normal
        lever = self.shapes.corner(s, w, i, corner, self.shapes.midway(s, w, i, dt), leant)
        lever -= 0.5 * overlap * leant
        velocity = 0.0 * normal
        if ti.static(self.motion.moves):
            place = s.position[w, i] - 0.5 * dt * s.velocity[w, i] + lever
            velocity = self.motion.velocity_at(self.kept, w, place, t - 0.5 * ti.cast(dt, ti.f64))
        pair = law.wall_pair(s, w, i, self.wall_material)
        return law.shape_at_wall(
            s, w, i, arm, lever, normal, tilt, overlap, velocity, turning, pair, past, dt
        )

    @ti.func
    def touch_surfaces(self, s, w, i, lately, number, found, t, dt, commit):
        """Return force (N) and torque (N m) of a number of contacts found; their history is updated if
        ``commit``. There is nothing to do for a grain that has not touched the wall ``lately``."""
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        if lately > 0:
            used, fresh, slots = self.slots(s, w, i, number, found, t)
            for q in range(number):
                slot, new = (slots >> (4 * q)) & 15, (fresh >> q) & 1
                push, turn = self.touch_surface(s, w, i, q, slot, new, found, t, dt, commit)
                force, torque = force + push, torque + turn
            if commit:
                for m in range(CONTACTS):
                    if (used >> m) & 1 == 0:
                        for c in range(3 + self.stride):
                            self.surface_past[w, i, m * (3 + self.stride) + c] = 0.0
        return force, torque

    @ti.func
    def touch_surface(self, s, w, i, q, slot, new, found, t, dt, commit):
        """Return force (N) and torque (N m) of contact q of those found; ``slot`` stores its direction
        followed by its history, unless the contact is new."""
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        outward, at = ti.Vector([found[q, 0], found[q, 1], found[q, 2]]), slot * (3 + self.stride)
        before = self.motion.to_space(self.kept, w, outward, t)
        if new == 0:
            before = ti.Vector([self.surface_past[w, i, at + axis] for axis in ti.static(range(3))])
        for law, first, size in ti.static(self.laws):
            past = ti.Vector.zero(s.real, max(1, size))
            for c in ti.static(range(size)):
                past[c] = ti.select(new > 0, 0.0, self.surface_past[w, i, at + 3 + first + c])
            push, turn, known = self.touch(s, w, i, law, outward, before, found[q, 3], past, t, dt)
            force, torque = force + found[q, 4] * push, torque + found[q, 4] * turn
            if self.goes_through(s, w, i, outward, found[q, 3], t, dt):
                force[0] = ti.math.nan
            if commit:
                for c in ti.static(range(size)):
                    self.surface_past[w, i, at + 3 + first + c] = known[c]
        if commit:
            direction = self.motion.to_space(self.kept, w, outward, t)
            for axis in ti.static(range(3)):
                self.surface_past[w, i, at + axis] = direction[axis]
        return force, torque

    @ti.func
    def goes_through(self, s, w, i, outward, distance, t, dt):
        """Return whether the centre of grain i would be behind a sheet after another step like this one, so
        that the sheet would push it out on the wrong side; ``distance`` (m) and direction ``outward`` lead to
        the sheet."""
        away = self.motion.to_space(self.kept, w, outward, t)
        sheet = self.motion.velocity_at(self.kept, w, s.position[w, i] - distance * away, t)
        return dt * (sheet - s.velocity[w, i]).dot(away) > distance

    @ti.func
    def slots(self, s, w, i, number, found, t):
        """Return the history slots of the contacts found: a bit mask of used slots, a bit mask of new
        contacts, and the slot of each contact in four bits."""
        used, fresh, slots = 0, 0, 0
        for q in range(number):
            outward = ti.Vector([found[q, 0], found[q, 1], found[q, 2]])
            direction = self.motion.to_space(self.kept, w, outward, t)
            slot, most = -1, ti.cast(STILL_THE_SAME, s.real)
            for m in range(CONTACTS):
                at, along = m * (3 + self.stride), ti.cast(0.0, s.real)
                for axis in ti.static(range(3)):
                    along += self.surface_past[w, i, at + axis] * direction[axis]
                if (used >> m) & 1 == 0 and along > most:
                    slot, most = m, along
            if slot < 0:
                fresh |= 1 << q
            else:
                used |= 1 << slot
                slots |= slot << (4 * q)
        # New contacts take the remaining slots.
        for q in range(number):
            if (fresh >> q) & 1 > 0:
                slot = 0
                while (used >> slot) & 1 > 0:
                    slot += 1
                used |= 1 << slot
                slots |= slot << (4 * q)
        return used, fresh, slots
