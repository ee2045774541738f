"""Sums over the overlaps of hard bodies."""

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.walls.confinement import Confinement
from tisim.numerics.vectors import piece
from tisim.pairs.listed_pairs import ExportedTerms
from tisim.pairs.pair_sum import ListedLaws, PairSum
from tisim.state.bound import Bound
from tisim.state.fields import Field
from tisim.steppers.context import StepContext

OVERLAP_PUSH = Field("overlap_push", "", 3, "keep", scratch=True)
"""Sum of the weighted normals of the overlaps of a body, away from the others."""
OVERLAP_TWIST = Field("overlap_twist", "", 3, "keep", scratch=True)
"""Sum of the moments of these normals, with arms in units of D."""
INVERSE_OVERLAP = Field("inverse_overlap", "1/m", 1, "keep", scratch=True)
"""1 over the smallest overlap of a body; 0 for a body without overlaps."""
OVERLAP_ENERGY = Field("overlap_energy", "", 1, "keep", scratch=True)
"""Half the energy of the overlaps of a body with others, and the energy of those with walls, in units of
their stiffness times D^2."""
DEEPEST_OVERLAP = Field("deepest_overlap", "", 1, "keep", scratch=True)
"""The deepest overlap of a body, in D."""
REMOVAL_RATE = Field("removal_rate", "1/s", 1, "keep", scratch=True)
"""Largest speed at which the motion of a body removes an overlap, over the overlap."""


DEEPEST_VIRTUAL = 0.5
"""Depth behind a wall (D) up to which virtual bodies are placed."""


class BodySum(PairSum):
    """Base of the sums over the overlaps of bodies, with each other and with the walls of a confinement.

    A subclass defines ``wall_term``, the term of a body that overlaps a wall, and ``finish_body`` in place of
    ``finish``. The stepper has a parameter ``tolerance``: overlaps (in D) up to this one do not count.
    """

    commits: ClassVar[bool] = False

    def __init__(self, context: StepContext, bodies: Bound[Any]) -> None:
        assert context.neighbour_lists is not None
        super().__init__(context.s, context.domain, (bodies,), context.neighbour_lists.pairs)
        self.bodies, self.stepper = bodies, context.stepper
        self.confinements = context.effects.of(Confinement)

    def exported(self) -> ExportedTerms:
        """Return the memory of the terms between chunks."""
        assert self.pairs is not None
        return ExportedTerms(self.pairs, self.components)

    @ti.func
    def overlap(self, w, i, j, separation):
        """Return the overlap (m) of two bodies, whether it counts, the normal from i to j, and the points of
        contact, in units of D of each body."""
        s = self.s
        size_i = self.bodies.size(s, w, i) * self.bodies.unit(w, 0)
        size_j = self.bodies.size(s, w, j) * self.bodies.unit(w, 0)
        allowed = self.stepper.tolerance(w) * ti.min(size_i, size_j)
        gap, normal, here, there = self.bodies.closest(s, w, i, j, separation, -allowed)
        counts = -gap > allowed
        return -gap, counts, normal, here / size_i, there / size_j

    @ti.func
    def wall_overlap(self, confinement: ti.template(), w, i, wall, end):  # type: ignore[valid-type]
        """Return the overlap (m) of an end of a body with a wall, whether it counts, the normal from the body
        to the wall or to the virtual body, and the point of contact in units of D."""
        s, middle = self.s, self.bodies.end_centre(self.s, w, i, end)
        size = self.bodies.size(s, w, i) * self.bodies.unit(w, 0)
        place = s.position[w, i] - self.domain.origin(w) + middle
        gap, outward = confinement.container.wall(w, wall, place, self.domain.side(w), size)
        here = self.bodies.support(s, w, i, end, outward)
        depth, normal = (here - middle).dot(outward) - gap, outward
        if ti.static(confinement.treatment == "virtual"):  # noqa: SIM102
            if depth > 0.0 and depth < DEEPEST_VIRTUAL * size:
                point, along = here - depth * outward, confinement.container.along(w, wall, outward)
                gap, normal, here, _there = self.bodies.closest_virtual(s, w, i, point, outward, along)
                depth = -gap
        return depth, depth > self.stepper.tolerance(w) * size, normal, here / size

    @ti.func
    def wall_term(self, w, i, depth, counts, normal, here):
        """Return the contribution of an overlap of body i with a wall to its sum, given the results of
        ``wall_overlap``."""
        return ti.Vector.zero(self.s.real, self.components)

    @ti.func
    def finish(self, w, i, total, t):
        for confinement in ti.static(self.confinements):
            ends = self.bodies.end_count(self.s, w, i)
            for k in range(ti.static(confinement.data.container.walls()) * ends):
                depth, counts, normal, here = self.wall_overlap(confinement, w, i, k // ends, k % ends)
                total = self.combine(total, self.wall_term(w, i, depth, counts, normal, here))
        self.finish_body(w, i, total)

    @ti.func
    def finish_body(self, w, i, total):
        """Use the finished sum of i over bodies and walls."""


class MotionSum(BodySum):
    """Base of the sums that set push and twist of each body and its ``further`` fields, the last of which is
    a maximum."""

    further: ClassVar[tuple[Field, ...]]

    def __init__(self, context: StepContext, bodies: Bound[Any]) -> None:
        super().__init__(context, bodies)
        self.columns = tuple(getattr(context.s, one.name) for one in self.further)
        self.components = 6 + len(self.columns)

    @ti.func
    def combine(self, a, b):
        total = a + b
        total[self.components - 1] = ti.max(a[self.components - 1], b[self.components - 1])
        return total

    @ti.func
    def write_sum(self, w, i, total):
        s = self.s
        for k in ti.static(range(3)):
            s.overlap_push[w, i][k], s.overlap_twist[w, i][k] = total[k], total[3 + k]
        for k, column in ti.static(enumerate(self.columns)):
            column[w, i] = total[6 + k]

    @ti.func
    def read_sum(self, w, i):
        total = ti.Vector.zero(self.s.real, self.components)
        push, twist = self.s.overlap_push[w, i], self.s.overlap_twist[w, i]
        for k in ti.static(range(3)):
            total[k], total[3 + k] = push[k], twist[k]
        for k, column in ti.static(enumerate(self.columns)):
            total[6 + k] = column[w, i]
        return total


class SumOverlaps(MotionSum):
    """This sum sets push and twist of each body, and the inverse of its smallest overlap."""

    further = (INVERSE_OVERLAP,)

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        return ListedLaws(laws, 4 if self.bodies.spheres else 10, False)

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        depth, counts, normal, here, there = self.overlap(w, i, j, separation)
        thickness = self.bodies.half_width(self.s, w, i) + self.bodies.half_width(self.s, w, j)
        weight = ti.select(counts, self.stepper.weight(depth / thickness), 0.0)
        values = ti.Vector.zero(self.s.real, ti.static(4 if self.bodies.spheres else 10))
        values[0] = ti.select(counts, 1.0 / ti.select(counts, depth, 1.0), 0.0)
        push, turn_i, turn_j = weight * normal, -weight * here.cross(normal), weight * there.cross(normal)
        for k in ti.static(range(3)):
            values[1 + k] = push[k]
            if ti.static(not self.bodies.spheres):
                values[4 + k], values[7 + k] = turn_i[k], turn_j[k]
        return values

    @ti.func
    def wall_term(self, w, i, depth, counts, normal, here):
        # Unlike another body, a wall may be deeper than D; the weight of the original method would change its
        # sign there.
        part = depth / (2.0 * self.bodies.half_width(self.s, w, i))
        weight = self.stepper.weight(ti.min(part, DEEPEST_VIRTUAL))
        push = -ti.select(counts, weight, 0.0) * normal
        turn, over = here.cross(push), ti.select(counts, 1.0 / ti.select(counts, depth, 1.0), 0.0)
        return ti.Vector([push[0], push[1], push[2], turn[0], turn[1], turn[2], over])

    @ti.func
    def pair_contributions(self, values):
        one, other = ti.Vector.zero(self.s.real, 7), ti.Vector.zero(self.s.real, 7)
        for k in ti.static(range(3)):
            one[k], other[k] = -values[1 + k], values[1 + k]
            if ti.static(not self.bodies.spheres):
                one[3 + k], other[3 + k] = values[4 + k], values[7 + k]
        one[6] = other[6] = values[0]
        return one, other

    @ti.func
    def finish_body(self, w, i, total):
        self.write_sum(w, i, total)
        if total[6] > 0.0:
            ti.atomic_add(self.s.overlapping[w], ti.i64(1))


class RemovalRates(BodySum):
    """This sum sets the largest rate at which the motion of a body, push and twist, removes one of its
    overlaps."""

    components = 1

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        return ListedLaws(laws, 2, False)

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        s = self.s
        depth, counts, normal, here, there = self.overlap(w, i, j, separation)
        over = ti.select(counts, 1.0 / ti.select(counts, depth, 1.0), 0.0)
        speed_i = -(s.overlap_push[w, i] + s.overlap_twist[w, i].cross(here)).dot(normal)
        speed_j = (s.overlap_push[w, j] + s.overlap_twist[w, j].cross(there)).dot(normal)
        return ti.Vector([ti.max(speed_i, 0.0) * over, ti.max(speed_j, 0.0) * over])

    @ti.func
    def wall_term(self, w, i, depth, counts, normal, here):
        s = self.s
        speed = -(s.overlap_push[w, i] + s.overlap_twist[w, i].cross(here)).dot(normal)
        over = ti.select(counts, 1.0 / ti.select(counts, depth, 1.0), 0.0)
        return ti.Vector([ti.max(speed, 0.0) * over])

    @ti.func
    def pair_contributions(self, values):
        return ti.Vector([values[0]]), ti.Vector([values[1]])

    @ti.func
    def combine(self, a, b):
        return ti.max(a, b)

    @ti.func
    def write_sum(self, w, i, total):
        self.s.removal_rate[w, i] = total[0]

    @ti.func
    def read_sum(self, w, i):
        return ti.Vector([self.s.removal_rate[w, i]])

    @ti.func
    def finish_body(self, w, i, total):
        self.write_sum(w, i, total)


class SumSoftOverlaps(MotionSum):
    """This sum sets force, torque and energy of bodies that repel each other by harmonic springs.

    The energy of a pair is (delta_ij/D_ij)^2 / 2, with the overlap delta_ij and the mean D_ij of both D. The
    force on a body is its derivative by the displacement in D of the body: (delta_ij/D_ij) D_i/D_ij along the
    normal; it acts on the point of contact, because moving a point of contact along its surface does not
    change the overlap to first order.
    """

    further = (OVERLAP_ENERGY, DEEPEST_OVERLAP)

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        return ListedLaws(laws, 6 if self.bodies.spheres else 12, False)

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        s = self.s
        gap, normal, here, there = self.bodies.closest(s, w, i, j, separation, 0.0)
        size_i = self.bodies.size(s, w, i) * self.bodies.unit(w, 0)
        size_j = self.bodies.size(s, w, j) * self.bodies.unit(w, 0)
        over = 2.0 / (size_i + size_j)
        depth = ti.max(-gap, 0.0) * over
        push, turn_i, turn_j = depth * normal, -depth * here.cross(normal), depth * there.cross(normal)
        values = ti.Vector.zero(s.real, ti.static(6 if self.bodies.spheres else 12))
        values[0], values[1], values[2] = depth, size_i * over, size_j * over
        for k in ti.static(range(3)):
            values[3 + k] = push[k]
            if ti.static(not self.bodies.spheres):
                values[6 + k], values[9 + k] = over * turn_i[k], over * turn_j[k]
        return values

    @ti.func
    def pair_contributions(self, values):
        one, other = ti.Vector.zero(self.s.real, 8), ti.Vector.zero(self.s.real, 8)
        for k in ti.static(range(3)):
            one[k], other[k] = -values[1] * values[3 + k], values[2] * values[3 + k]
            if ti.static(not self.bodies.spheres):
                one[3 + k], other[3 + k] = values[6 + k], values[9 + k]
        one[6] = other[6] = 0.25 * values[0] * values[0]
        one[7] = other[7] = values[0]
        return one, other

    @ti.func
    def wall_term(self, w, i, depth, counts, normal, here):
        size = self.bodies.size(self.s, w, i) * self.bodies.unit(w, 0)
        deep = ti.max(depth, 0.0) / size
        force = -deep * normal
        turn = here.cross(force)
        return ti.Vector([force[0], force[1], force[2], turn[0], turn[1], turn[2], 0.5 * deep * deep, deep])

    @ti.func
    def finish_body(self, w, i, total):
        self.write_sum(w, i, total)
        if total[7] > self.stepper.tolerance(w):
            ti.atomic_add(self.s.overlapping[w], ti.i64(1))
