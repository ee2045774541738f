"""At rest: a run ends when its grains have come to rest, instead of at a fixed time."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import Component
from tisim.effects.base import Constraint
from tisim.effects.external.gravity import Gravity
from tisim.numerics.ieee import finite
from tisim.operators.at_intervals import AtIntervals
from tisim.operators.base import parameter
from tisim.operators.insertion import Insertion
from tisim.state.bound import Peers
from tisim.state.fields import WorldField

LOOKS = 10
"""Number of checks of the grains within the time for which they must be at rest."""


class AtRest(AtIntervals):
    """A world ends when its grains have been at rest for a given time.

        sum_i (m_i v_i^2 + 2/5 m_i R_i^2 w_i^2) / 2  <=  energy * g sum_i m_i R_i
        sum_i |F_i|                                  <=  unbalanced * g sum_i m_i

    g is the acceleration of gravity. A scene without gravity has no weight, so g must be given, as
    ``reference_acceleration``: for instance the attraction of two touching grains over their mass. The first
    ratio is the kinetic energy over the energy of a fall by one radius. The second is the unbalanced force,
    summed over the grains as the magnitude of the resultant on each, over the weight. (YADE and PFC divide by
    the mean contact force, which in a deep bed is larger than the weight; here a grain at the top has the
    same weight in the sum as one below.) Each criterion alone can be met by grains that move: the first by
    grains that have just been released, the second by grains that fall at a steady speed. A rigid clump has
    the kinetic energy of the body and the resultant on the body.

    The grains are checked ten times in ``time`` and must be at rest each time. Grains that are fixed, or that
    move as prescribed, do not count; without other grains nothing is at rest. Nothing is at rest either until
    insertions are complete (insertions by fraction: until they have begun). The ratios at the last check are
    ``measures``: ``kinetic_ratio`` and ``unbalanced_ratio``. The run ends at the ``duration`` of the scene at
    the latest.

    Source: C. O'Sullivan, Particulate Discrete Element Modelling (2011), section 2.6.
    """

    world_fields = (
        WorldField("kinetic_ratio", "measure"),
        WorldField("unbalanced_ratio", "measure"),
        WorldField("looks_at_rest", "integer"),
    )
    any_order: ClassVar[bool] = True
    terms: ClassVar = 4
    requires: ClassVar = (Gravity,)
    ends: ClassVar = "grains are at rest"

    energy: float = parameter(
        "", "kinetic energy at rest, over the energy of a fall by one radius", 1e-5, gt=0
    )
    unbalanced: float = parameter("", "unbalanced force at rest, over the weight", 1e-2, gt=0)
    time: float = parameter("s", "time for which grains must be at rest", gt=0, examples=[0.05])
    reference_acceleration: float = parameter(
        "m/s^2", "acceleration g that sets the weight; 0 for the acceleration of gravity", 0.0, ge=0
    )

    def required_effects(self) -> tuple[type[Component], ...]:
        # With a given acceleration it does not need gravity.
        return () if self.reference_acceleration > 0 else super().required_effects()

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {
            "gravity": peers.of(Gravity),
            "insertions": peers.of(Insertion),
            "constraints": peers.of(Constraint),
        }

    @ti.func
    def elapsed(self, s, w):
        return LOOKS * s.time[w] / ti.cast(self.time(w), ti.f64)

    @ti.func
    def each(self, s, w, i):
        terms = ti.Vector.zero(ti.f64, self.terms)
        if self.is_free(s, w, i):
            energy, force = self.balance(s, w, i)
            m, radius = s.mass[w, i], s.radius[w, i]
            terms = ti.cast(ti.Vector([energy, force, m, m * radius]), ti.f64)
        return terms

    @ti.func
    def world(self, s, w):
        self.count_interval(s, w)
        acceleration = 0.0 * s.position[w, 0]
        for gravity in ti.static(self.gravity):
            acceleration += gravity.acceleration(w)
        total, g = self.sums.total(w), ti.cast(self.reference_acceleration(w), ti.f64)
        if g == 0.0:
            g = ti.cast(acceleration.norm(), ti.f64)
        kinetic, unbalanced, weight, depth = total[0], total[1], g * total[2], g * total[3]
        calm = weight > 0.0 and kinetic <= self.energy(w) * depth
        calm = calm and unbalanced <= self.unbalanced(w) * weight
        for insertion in ti.static(self.insertions):
            calm = calm and insertion.pending(s, w) == 0
        if weight > 0.0:
            s.kinetic_ratio[w], s.unbalanced_ratio[w] = kinetic / depth, unbalanced / weight
            if not finite(s.kinetic_ratio[w] + s.unbalanced_ratio[w]):
                s.fail_world_by_effect(w, self.index)
        s.looks_at_rest[w] = ti.select(calm, s.looks_at_rest[w] + 1, 0)
        if s.looks_at_rest[w] > LOOKS:
            s.finish(w, self.index)

    @ti.func
    def balance(self, s, w, i):
        """Return the kinetic energy (J) and the magnitude of the force (N) of a grain. For a body they are
        returned with the particle that represents it, and are zero for its other particles."""
        m, radius = s.mass[w, i], s.radius[w, i]
        energy, force = 0.5 * m * s.velocity[w, i].norm_sqr(), s.force[w, i].norm()
        if ti.static(hasattr(s, "spin")):
            energy += 0.2 * m * radius * radius * s.spin[w, i].norm_sqr()
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i):
                energy, force = 0.0 * m, 0.0 * m
                if constraint.leads(s, w, i):
                    energy, force = constraint.balance(s, w, i)
        return energy, force

    @ti.func
    def is_free(self, s, w, i):
        free = True
        if ti.static(hasattr(s, "fixed")):
            free = s.fixed[w, i] == 0
        for constraint in ti.static(self.constraints):
            if ti.static(not constraint.data.free):
                free = free and not constraint.holds(s, w, i)
        return free
