"""Contacts of bodies with shapes with spheres, cylinders and cones.

A curved wall is the envelope of its tangent planes. A body inside it touches the plane that it overlaps most,

    delta = max over n of h(n) + n . (r - o) - c

with the farthest point x(n) of the body along the normal n, h(n) = n . x(n), the centre r of the body and the
plane n . (r - o) = c. As the largest value of a maximum, its change by a small motion is the change at
constant n, so that elastic forces are the gradient of an energy. n follows by the iteration

    n -> normal of the wall at r + x(n)

in which delta never decreases, because the distance beyond the wall is a convex function of the place. It
converges by the ratio of the radii of curvature of body and wall. It begins at several normals, since a body
may touch at several points; the deepest one counts, for each ``corner`` of the shape.

Outside a sphere or a cylinder the closest points of two convex bodies are sought: the wall is a rod.
"""

from typing import TYPE_CHECKING, Any

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.effects.contact.granular.shape_contact import leaning
from tisim.numerics.vectors import normal_to

ROUNDS = 60
"""Largest number of iterations from one normal."""
STEP_ASIDE = 0.5
"""Sideways displacement, over the radius of the body, of the further places from which a normal is sought."""
END_SLACK = 0.1
"""Distance beyond the end of a cylinder or a cone, over half the thickness of a body, at which the body still
touches its continuation."""


def same_direction() -> float:
    """Return the square of the change of a unit vector below which an iteration has converged."""
    return 1e-25 if runtime.current().precision == "f64" else 1e-13


class CurvedWalls:
    """Curved walls compute the forces of the curved surfaces of a bound wall on bodies with shapes.

    envelopes : the lists of surfaces, each with the number of rows in memory before it; envelope_rows : the
    number of all rows. The other attributes are those of ``WallContacts``.
    """

    if TYPE_CHECKING:
        envelopes: Any
        envelope_rows: Any
        laws: Any
        stride: Any
        corners: Any
        shapes: Any
        motion: Any
        kept: Any
        surface_past: Any
        wall_material: Any
        reach: Any

    @ti.func
    def touch_envelopes(self, s, w, i, r, before, t, dt, commit):
        """Return force (N) and torque (N m) of all curved surfaces on body i, at r (m) in the body frame of
        the wall, the number of surfaces within reach of its centre, and the distance (m) of the nearest one.
        before : the number of contacts a step ago."""
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        number, beside = 0, ti.cast(ti.math.inf, s.real)
        # One loop for all lists and corners, so that the search for a contact is compiled once.
        for row in range(self.envelope_rows):
            place, axis, planes = 0.0 * force, 0.0 * force, ti.Vector.zero(s.real, 4)
            distance = ti.cast(ti.math.inf, s.real)
            for each, first in ti.static(self.envelopes):
                k = row - first
                if k >= 0 and k < each.size(w):
                    origin, line, numbers = each.tangents(w, k)
                    place, axis, planes = r - origin, line, numbers
                    distance = each.distance(w, k, r)
            beside = ti.min(beside, distance)
            near = ti.select(distance <= self.reach(s, w, i), 1, 0)
            number += near
            if near + before > 0:
                place = self.motion.to_space(self.kept, w, place, t)
                axis = self.motion.to_space(self.kept, w, axis, t)
                for corner in range(self.corners):
                    push, turn = self.touch_envelope(
                        s, w, i, row, corner, near, place, axis, planes, t, dt, commit
                    )
                    force, torque = force + push, torque + turn
        return force, torque, number, beside

    @ti.func
    def touch_envelope(self, s, w, i, row, corner, near, place, axis, planes, t, dt, commit):
        """Return force (N) and torque (N m) of a surface on one corner of a body; the contact history is
        updated if ``commit``."""
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        for law, begin, size in ti.static(self.laws):
            past = ti.Vector.zero(s.real, max(1, size))
            at = (row * self.corners + corner) * self.stride + begin
            for c in ti.static(range(size)):
                past[c] = self.surface_past[w, i, at + c]
            known = 0.0 * past
            if near > 0:
                push, turn, known = self.touch_tangent(s, w, i, law, corner, place, axis, planes, past, t, dt)
                force, torque = force + push, torque + turn
            if commit:
                for c in ti.static(range(size)):
                    self.surface_past[w, i, at + c] = known[c]
        return force, torque

    @ti.func
    def touch_tangent(self, s, w, i, law: ti.template(), corner, place, axis, planes, past, t, dt):  # type: ignore[valid-type]
        """Return force (N), torque (N m) and history of the contact of one corner of a body.

        place : centre of the body, relative to the point on the axis of the surface (m), and axis, in space.
        """
        turning, half = self.motion.angular_velocity(w), 0.5 * dt
        middle = t - 0.5 * ti.cast(dt, ti.f64)
        overlap, normal, x, beyond = 0.0 * place[0], 0.0 * place, 0.0 * place, 0.0 * place[0]
        lever, tilt, stage = 0.0 * place, 0.0 * place, 0
        then, line = place, axis
        # First at the end of the step; then midway, if there is a contact with springs.
        while stage < 2:
            q = self.shapes.midway(s, w, i, stage * dt)
            deep, n, y, end = self.on_envelope(s, w, i, corner, q, then, line, planes)
            if stage == 0:
                overlap, normal, x, beyond = deep, n, y, end
                lever = x - 0.5 * overlap * normal
                # The surface moves and turns with the wall.
                drift = self.motion.velocity_at(self.kept, w, s.position[w, i] - place, middle)
                then, line = place - half * (s.velocity[w, i] - drift), axis - half * turning.cross(axis)
                stage = ti.select(overlap > -s.radius[w, i], ti.select(law.turns_springs, 1, 2), 2)
            else:
                tilt, stage = leaning(n, normal), 2
                if n.dot(normal) > 0.0:
                    lever = y - 0.5 * overlap * n
        velocity = 0.0 * normal
        if ti.static(self.motion.moves):
            at = s.position[w, i] - half * s.velocity[w, i] + lever
            velocity = self.motion.velocity_at(self.kept, w, at, middle)
        pair = law.wall_pair(s, w, i, self.wall_material)
        arm = x - 0.5 * overlap * normal
        force, torque, known = law.shape_at_wall(
            s, w, i, arm, lever, normal, tilt, overlap, velocity, turning, pair, past, dt
        )
        if overlap > 0.0 and beyond > END_SLACK * self.half_thickness(s, w, i):
            # Rims are no part of the envelope.
            force[0] = ti.math.nan
        return force, torque, known

    @ti.func
    def half_thickness(self, s, w, i):
        """Return half the smallest extent (m) of body i."""
        return self.shapes.size(s, w, i) * self.shapes.thickness(w, s.shape[w, i])

    @ti.func
    def on_envelope(self, s, w, i, corner, q, place, axis, planes):
        """Return the overlap (m) of a corner of body i, the unit normal into the wall, the point of contact
        relative to the centre (m), and how far the point is beyond the ends of the surface (m)."""
        # The second corner of a body outside touches nothing.
        overlap, normal, x = -2.0 * s.radius[w, i], 0.0 * place, 0.0 * place
        height, end = place.dot(axis), planes[3]
        inside = planes[0] * (place - height * axis).norm() + planes[1] * height < planes[2]
        if inside:
            overlap, normal, x = self.deepest_tangent(s, w, i, corner, q, place, axis, planes)
        elif corner == 0:
            # A cylinder is a rod from 0 to L, a sphere a rod without length.
            away = 0.5 * end * axis - place
            gap, n, here = self.shapes.beside_rod(s, w, i, q, away, axis, 0.5 * end, planes[2])
            overlap, normal, x = -gap, n, here
        along = (place + x).dot(axis)
        beyond = ti.select(end > 0.0, ti.max(-along, along - end), -1.0)
        if planes[1] != 0.0 and not inside:
            # No rod represents a cone.
            overlap, beyond = s.radius[w, i], 0.0 * along + ti.math.inf
        return overlap, normal, x, beyond

    @ti.func
    def tangent(self, place, axis, planes):
        """Return the normal of the tangent plane that is nearest to a place (m, relative to the axis)."""
        across = place - place.dot(axis) * axis
        size = across.norm()
        # On the axis all directions are equally far.
        z = ti.Vector([0.0 * size, 0.0 * size, 1.0 + 0.0 * size])
        side = normal_to(ti.select(axis.norm_sqr() > 0.0, axis, z))
        unit = ti.select(size > 0.0, across / ti.select(size > 0.0, size, 1.0), side)
        return planes[0] * unit + planes[1] * axis

    @ti.func
    def deepest_tangent(self, s, w, i, corner, q, place, axis, planes):
        """Return overlap, normal and point of contact, as ``on_envelope``, of a body inside the surface."""
        first = self.tangent(place, axis, planes)
        sphere = axis.norm_sqr() == 0.0
        aside = ti.select(sphere, normal_to(first), axis.cross(first))
        other = first.cross(aside)
        step = STEP_ASIDE * s.radius[w, i]
        overlap, normal, x = 0.0 * place[0] - ti.math.inf, first, 0.0 * place
        for start in range(ti.select(sphere, 5, 3)):
            sign = ti.select(start % 2 == 1, step, -step)
            shift = ti.select(start == 0, 0.0, ti.select(start < 3, sign, 0.0)) * aside
            shift += ti.select(start > 2, sign, 0.0 * sign) * other
            n = self.tangent(place + shift, axis, planes)
            last, y, deep, rounds, moving = n, x, 0.0 * overlap, 0, 1
            while moving == 1 and rounds < ROUNDS:
                last, y = n, self.shapes.corner(s, w, i, corner, q, n)
                deep = n.dot(place + y) - planes[2]
                n = self.tangent(place + y, axis, planes)
                moving = ti.select((n - last).norm_sqr() > ti.static(same_direction()), 1, 0)
                rounds += 1
            # The last normal is more accurate than the depth, which is at a maximum, can tell.
            if deep > overlap:
                overlap, normal, x = deep, last, y
        return overlap, normal, x
