"""Contacts of bodies with shapes, by the contact laws of spheres.

The gap of two bodies, its normal n and the points of contact come from the shapes
(``tisim/effects/base/shaped.py``). The force acts in the middle of the overlap, and its torque on each body
is the force times the lever from the centre. For an elastic force this is the gradient of its energy: the
gap is the largest distance d(n) of two parallel planes that touch the bodies, so that its change by a small
motion is the change of d at constant n.

Velocities are midway in a step, between the positions before and after it. The contact is therefore computed
a second time, for the positions midway, if the law has springs: the slip of the surfaces is theirs, and the
normal rotates from there to the end of the step (see spring.py).
"""

from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.spring import midway
from tisim.effects.contact.granular.step_limit import TRAVEL
from tisim.numerics.vectors import conjugate, rotated

SAME_NORMAL = 0.5
"""Smallest cosine between the normals midway and at the end of a step of one contact."""


@ti.func
def leaning(before, normal):
    """Return the tilt with which the unit vector ``before`` is along normal + tilt; 0 if they differ by too
    much to belong to the same contact."""
    along = before.dot(normal)
    same = along > SAME_NORMAL
    return ti.select(same, before / ti.select(same, along, 1.0) - normal, 0.0)


class ShapeContact:
    """A shape contact gives the force between two bodies, and between a body and a plane, by a contact law.

    shapes : the bound effect that gives particles their shapes, with ``moves``. The other attributes
    come from the contact law.
    """

    if TYPE_CHECKING:
        shapes: Any
        contact: Any
        lasts: Any
        reach: Any
        material_pair: Any
        turns_springs: ClassVar[Any]

    @ti.func
    def mobility(self, s, w, i, q, arm, normal):
        """Return how easily a contact at ``arm`` (m) from the centre of i turns it, times the mass of i: for
        a force along the normal, for one along any direction across it (an upper bound), and for a couple
        about any axis, times the square of the contact radius (an upper bound)."""
        inertia, back = self.shapes.inertia(s, w, i), conjugate(q)
        # In units of the radius of the bounding sphere.
        lever = rotated(back, arm) / s.radius[w, i]
        about = lever.cross(rotated(back, normal))
        along = (about / inertia).dot(about)
        square = lever * lever
        every = ((square.sum() - square) / inertia).sum()
        part = self.contact_radius(s, w, i) / s.radius[w, i]
        return ti.Vector([along, every - along, part * part / inertia.min()])

    @ti.func
    def contact_radius(self, s, w, i):
        """Return the radius of curvature (m) of i in the contact law."""
        return self.shapes.size(s, w, i) * self.shapes.contact_radius(w, s.shape[w, i])

    @ti.func
    def thickness(self, s, w, i):
        """Return half the smallest extent (m) of i."""
        return self.shapes.size(s, w, i) * self.shapes.thickness(w, s.shape[w, i])

    @ti.func
    def between_shapes(self, s, w, i, j, separation, past, dt):
        """Return force, torques and history of two bodies, as ``interaction`` does."""
        force, here, there, known = 0.0 * separation, 0.0 * separation, 0.0 * separation, 0.0 * past
        reach = ti.max(self.reach(s, w, i), self.reach(s, w, j)) + 0.0 * separation[0]
        passing = s.relative_velocity(w, i, j, separation)
        gap, normal, before, x_i, lever = 0.0 * reach, 0.0 * separation, 0.0 * separation, force, force
        apart, far, stage = separation, reach, 0
        # First at the end of the step; then midway, if there is a contact with springs.
        while stage < 2:
            q_i, q_j = self.shapes.midway(s, w, i, stage * dt), self.shapes.midway(s, w, j, stage * dt)
            width, n, y_i, _y_j = self.shapes.between(s, w, i, j, q_i, q_j, apart, far)
            if stage == 0:
                gap, normal, x_i = width, n, y_i
                apart, far = separation - 0.5 * dt * passing, ti.cast(ti.math.inf, s.real)
                stage = ti.select(gap <= reach, ti.select(self.turns_springs, 1, 2), 2)
            else:
                before, lever, stage = n, y_i + 0.5 * width * n, 2
        if gap <= reach:
            overlap, pair = -gap, self.material_pair(s, w, i, j)
            arm_i = x_i - 0.5 * overlap * normal
            # The force acts at one point, so that the total angular momentum is kept.
            arm_j = arm_i - separation
            spin_i, spin_j = s.spin[w, i], s.spin[w, j]
            slip = passing + spin_j.cross(arm_j) - spin_i.cross(arm_i)
            tilt, turn = 0.0 * normal, 0.0 * gap
            if ti.static(self.turns_springs):
                slip = passing + spin_j.cross(lever - apart) - spin_i.cross(lever)
                tilt, turn = leaning(before, normal), 0.25 * dt * (spin_i + spin_j).dot(normal)
                slip = midway(slip, slip.dot(before), normal, tilt, turn)
            q_i, q_j = self.shapes.turn(s, w, i), self.shapes.turn(s, w, j)
            a, b = self.contact_radius(s, w, i), self.contact_radius(s, w, j)
            radius = a * (b / (a + b))
            m, n, free = s.masses_behind(w, i, j)
            easy_i = self.mobility(s, w, i, q_i, arm_i, normal)
            easy_j = self.mobility(s, w, j, q_j, arm_j, normal)
            # The smaller mass times the inverse masses, which alone may overflow in f32.
            least = ti.min(m, n)
            share_i, share_j = least / m, least / n
            straight = share_i + share_j
            along = straight + share_i * easy_i[0] + share_j * easy_j[0]
            mass = least / along
            slides = share_i * easy_i[1] + share_j * easy_j[1]
            part_i, part_j = radius / a, radius / b
            rolls = share_i * easy_i[2] * part_i * part_i + share_j * easy_j[2] * part_j * part_j
            inverses = free / along * ti.Vector([along, straight + slides, rolls, ti.sqrt(slides * rolls)])
            push, couple, kept = self.contact(
                w, pair, normal, overlap, radius, mass, inverses, slip, spin_j - spin_i, tilt, turn, past, dt
            )
            least_size = ti.min(self.thickness(s, w, i), self.thickness(s, w, j))
            outrun = (overlap >= 0.0) & ((free * dt * slip).norm_sqr() > (TRAVEL * least_size) ** 2)
            push = ti.select(outrun, ti.math.nan, push)
            if self.lasts(w, pair, overlap, radius, past):
                force, known = push, kept
                here, there = arm_i.cross(push) + couple, -arm_j.cross(push) - couple
        return force, here, there, known

    @ti.func
    def shape_at_wall(self, s, w, i, arm, before, normal, tilt, overlap, velocity, turning, pair, past, dt):
        """Return force and torque of a plane on a body, and the contact history.

        arm : from the centre to the point of contact (m). before : the same midway in the step. normal, tilt,
        overlap, velocity, turning : as in ``at_wall``. pair : index of the pair of materials.
        """
        spin, turn = s.spin[w, i], 0.0 * overlap
        slip, leant = velocity - s.velocity[w, i] - spin.cross(arm), 0.0 * normal
        if ti.static(self.turns_springs):
            leant, turn = tilt, 0.25 * dt * (spin + turning).dot(normal)
            slip = velocity - s.velocity[w, i] - spin.cross(before)
            slip = midway(slip, slip.dot((normal + tilt).normalized()), normal, tilt, turn)
        m, free = s.mass_at_wall(w, i)
        easy = self.mobility(s, w, i, self.shapes.turn(s, w, i), arm, normal)
        along, radius = 1.0 + easy[0], self.contact_radius(s, w, i)
        inverses = ti.Vector([along, 1.0 + easy[1], easy[2], ti.sqrt(easy[1] * easy[2])])
        force, couple, known = self.contact(
            w, pair, normal, overlap, radius, m / along, free / along * inverses, slip, turning - spin, leant,
            turn, past, dt,
        )  # fmt: skip
        lasts = self.lasts(w, pair, overlap, radius, past)
        far = free * dt * ti.abs(slip.dot(normal)) > TRAVEL * self.thickness(s, w, i)
        force = ti.select((overlap >= 0.0) & far, ti.math.nan, force)
        force, couple = ti.select(lasts, force, 0.0), ti.select(lasts, couple, 0.0)
        return force, arm.cross(force) + couple, ti.select(lasts, known, 0.0)
