"""Capture: a particle that touches a magnet of the scene is fixed there, for ever or until it is released."""

from __future__ import annotations

from typing import Any, ClassVar

from scipy.constants import Boltzmann

from tisim.backend.taichi import ti
from tisim.components.component import Component
from tisim.effects.base import Constraint, Force, PairEvent, SelfConsistentQuantity
from tisim.effects.magnetic.moment import Moment
from tisim.numerics import philox
from tisim.numerics.random_streams import ADHESION
from tisim.operators.base import option
from tisim.operators.release import Release
from tisim.operators.touching_magnets import TouchingMagnets
from tisim.sources.base import sources
from tisim.sources.magnetic.magnets import Magnets
from tisim.state.bound import Peers
from tisim.state.fields import Field, WorldField

CLEARANCE_FIELDS = (
    Field("clearance", "m", 1, "keep", scratch=True),
    Field("cleared_from", "m", 3, "keep", scratch=True),
)
"""A distance within which there was no magnet when one was last looked for, and the place of the particle
then. It can touch none before it has moved by the difference of this distance and its radius."""
MOST_SURFACES = 8
"""Largest number of surfaces onto which a particle is placed in turn, in a gap narrower than itself."""
SQUEEZED = 1e-9
"""Overlap or distance that is left in such a gap, in radii."""
SURE = 0.999
"""Part of this path in which no magnet is looked for, whatever the rounding."""


class Capture(TouchingMagnets):
    """A particle that touches a magnet of the scene is fixed at the point of contact.

    A particle whose surface meets the surface of a magnet is placed on it and fixed: no force moves it any
    more, but it still acts on others. Three fields describe this: ``fixed`` is 1 (the initial state may fix
    particles too, which are not counted); ``captured_by`` is the number of the magnet, counted from 0 through
    the lists of the scene in order, or -1; ``captured_at`` is the end of the step in which the particle
    touched (s), or -1. ``work["captures"]`` is the number of captures. A particle whose step ends inside a
    magnet is moved to the nearest point outside, so the path in a step must be short compared with the size
    of the magnet. If it is then in another magnet, as in a gap narrower than itself, it is moved along the
    surface of the first until it rests on both. Impacts are refused, because they would move a captured
    particle.

    A captured particle stays for ever, as in B16 6.3, unless ``release`` is given. ``Release`` describes when
    a particle is then freed; ``captured_by`` and ``captured_at`` are -1 again, ``released_at`` is the time of
    the last release (s) or -1, ``adheres`` is 1 for a particle that is never released, and ``capture_count``
    is the number of captures of a particle. ``work["releases"]`` is the number of releases, so captures minus
    releases is the number of particles that are captured.

    Source: B16 section 6.3.
    """

    fields: ClassVar = (
        "radius",
        "fixed",
        Field("captured_by", "", 1, "keep", integer=True, default=-1),
        Field("captured_at", "s", 1, "keep", default=-1.0),
    )
    release_fields: ClassVar = (
        Field("released_at", "s", 1, "keep", default=-1.0),
        Field("adheres", "", 1, "keep", integer=True),
        Field("capture_count", "", 1, "keep", integer=True),
    )
    world_fields: ClassVar = (WorldField("captures", "counter"),)
    requires: ClassVar = (Magnets,)
    excludes: ClassVar = (PairEvent, Constraint)

    release: Release | None = option(
        "conditions under which captured particles are released; they stay for ever unless given", None
    )

    @property
    def acts_on_fixed(self) -> bool:  # type: ignore[override]
        """Return whether captured particles may be released."""
        return self.release is not None

    def members(self) -> dict[str, Component]:
        return {} if self.release is None else {"release": self.release}

    def required_fields(self) -> tuple[str | Field, ...]:
        return (*self.fields, *CLEARANCE_FIELDS, *(self.release_fields if self.release else ()))

    def required_world_fields(self) -> tuple[WorldField, ...]:
        releases = (WorldField("releases", "counter"),) if self.release else ()
        return (*self.world_fields, *releases)

    def connect(self, peers: Peers) -> dict[str, Any]:
        moments = peers.of(Moment)
        return {
            **super().connect(peers),
            "releases": self.release is not None,
            "forces": peers.of(Force),
            "moments": tuple(one for one in moments if not isinstance(one.data, SelfConsistentQuantity)),
            "flows": sources(peers, "flow_velocity"),
        }

    @ti.func
    def particle(self, s, w, i, t, dt):
        r, radius = s.position[w, i], s.radius[w, i]
        clear = ti.max(SURE * (s.clearance[w, i] - radius), 0.0)
        by, outward, free = -1, 0.0 * r, s.fixed[w, i] == 0
        if free and not ((r - s.cleared_from[w, i]).norm_sqr() < clear * clear):
            place, tries, going = r, 0, True
            # One call for all surfaces, as magnets may take long to compile.
            while going and tries < MOST_SURFACES:
                # A surface that the last displacement has left is found again.
                touched, distance, away = self.touched(w, place, ti.select(tries == 0, 1.0, 1.5) * radius)
                if tries == 0:
                    s.clearance[w, i], s.cleared_from[w, i] = distance, r
                overlap = radius - distance
                going = touched >= 0 and (tries == 0 or ti.abs(overlap) > SQUEEZED * radius)
                if going:
                    out = self.along(outward, away) * overlap
                    going = out.norm_sqr() <= 4.0 * radius * radius or tries == 0
                    if going:
                        by, outward, place = touched, away, place + out
                tries += 1
            s.position[w, i] = place
        if self.may_come_off(s, w, i, t):
            by = s.captured_by[w, i]
            outward = self.outward(w, by, r)
        if by >= 0:
            # One call, as the laws of a scene may take long to compile.
            holds = self.holds(s, w, i, t, outward)
            if free and holds:
                self.capture(s, w, i, by, t)
            elif free:
                inward = ti.min(s.velocity[w, i].dot(outward), 0.0)
                s.velocity[w, i] -= inward * outward
            elif not holds:
                self.let_go(s, w, i, t)

    @ti.func
    def along(self, resting, away):
        """Return the displacement per overlap that takes a particle off a surface with the outward normal
        ``away``, along the surface with the normal ``resting`` on which it is already; 0 for none."""
        c = away.dot(resting)
        across = ti.max(1.0 - c * c, 1e-12)
        return (away - c * resting) / across

    @ti.func
    def may_come_off(self, s, w, i, t):
        """Return whether particle i was captured in an earlier step and does not adhere."""
        may = False
        if ti.static(self.releases):
            may = s.captured_by[w, i] >= 0 and s.adheres[w, i] == 0 and s.captured_at[w, i] < t
        return may

    @ti.func
    def let_go(self, s, w, i, t):
        """Release particle i."""
        if ti.static(self.releases):
            s.fixed[w, i], s.captured_by[w, i], s.captured_at[w, i] = 0, -1, -1.0
            s.released_at[w, i] = ti.cast(t, s.real)
            ti.atomic_add(s.releases[w], 1)

    @ti.func
    def capture(self, s, w, i, by, t):
        """Fix particle i where it is, at the surface of a magnet."""
        s.fixed[w, i] = 1
        s.captured_by[w, i] = by
        s.captured_at[w, i] = ti.cast(t, s.real)
        s.velocity[w, i] = 0.0 * s.velocity[w, i]
        if ti.static(hasattr(s, "spin")):
            s.spin[w, i] = 0.0 * s.velocity[w, i]
        if ti.static(self.releases):
            words = philox.bits(s.seed[w], ADHESION, s.id[w, i], s.capture_count[w, i])
            adheres = philox.uniform(words)[0] < ti.cast(self.release.adhering(w), ti.f64)
            s.adheres[w, i] = ti.cast(adheres, ti.i32)
            s.capture_count[w, i] += 1
        ti.atomic_add(s.captures[w], 1)

    @ti.func
    def holds(self, s, w, i, t, outward):
        """Return whether particle i is held at a surface with this outward normal at time t (s)."""
        holds = True
        if ti.static(self.releases):
            r, radius = s.position[w, i], s.radius[w, i]
            force = 0.0 * r
            for moment in ti.static(self.moments):
                s.moment[w, i] = moment.response(s, w, i, 0.0 * r, t)
            for law in ti.static(self.forces):
                of_law, _torque = law.load(s, w, i, t, ti.cast(0.0, s.real), False)
                force += of_law
            for flow in ti.static(self.flows):
                drag = 6.0 * ti.math.pi * self.release.viscosity(w) * radius
                force += drag * flow.value(w, r, t)
            thermal = Boltzmann * self.release.temperature(w) / radius
            pressing = self.release.adhesion_force(w) - force.dot(outward)
            holds = pressing > self.release.least_force(w) * thermal
        return holds
