"""Impact of two grains with a restitution that depends on pressure and temperature (Z04 sections 2-4).

Along the line of centres, with momentum conserved and restitution e (Z04 Eqs 2.1-2.5):

    m I = m_i m_j / (m_i + m_j) * v_n (1 + e)      the impulse, v_n the approach speed
    dtau = dtau_1 (1 + e),  dtau_1 = 2 b* / v_n     its duration, b* = beta min(b_i, b_j)   (4.10)
    |I_n| = impulse / dtau = m_ij v_n^2 / (2 b*)    the mean force, which does not depend on e
    a = (a_0 + (a_f - a_0)(1 - e)) pi min(b)^2      the contact area                        (4.12)
    e = max(1 - |I_n| / (2 a min(H_i, H_j)), 0)                                             (3.1)

The paper iterates (3.1) from e = 0. With its own a_0 = 0, a_f = 1 this map is x -> p/x for x = 1 - e, which
oscillates for ever. For a given H, however, (3.1) with (4.12) is a quadratic equation in x,

    (a_f - a_0) x^2 + a_0 x = p,   p = |I_n| / (2 pi min(b)^2 min(H)),

so x is solved for exactly, and only the coupling to temperature is iterated: heat depends on e, hardness on
temperature. A larger x gives more heat and lower hardness, so the map increases with x. Started from e = 0 as
in the paper, it decreases monotonically to its largest fixed point and cannot alternate between bond and
rebound. With friction heat may decrease slightly with x; the number of iterations is therefore limited, and
impacts that reach the limit are counted. x >= 1 means that the pair bonds.

Lost kinetic energies refer to the frame of the pair's centre of mass. The paper uses 1/2 m v^2 of each
particle (5.1, 6.10). The division of this energy between the two depends on the frame of reference and can
cool a grain below absolute zero; the sum, which enters the balances of heat and energy, is the same.

A pair at relative rest is in contact, not colliding. Bonded grains therefore leave with exactly the same
velocity, and an approach must exceed the rounding error of a pair at rest. With u the unit roundoff, each
velocity is known to a relative accuracy of u, their difference is rounded once, and a product of three
components three times (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. 2002, Eq. 3.5):
together this is 5 u (|v_i| + |v_j|) . |r_ij|, by components. A pair that is ignored for this reason
approaches by less than the rounding of its path. A pair in contact that forces press together does not
collide either: see resting.py.
"""

from __future__ import annotations

from typing import Any, ClassVar, Self

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.effects.base import Force, PairEvent, PairForce, option, parameter
from tisim.effects.impact.law import HOOKS, ImpactLaw
from tisim.effects.impact.resting import rests, rounding, support
from tisim.errors import must
from tisim.state.bound import Peers
from tisim.state.fields import WorldField


class Impact(PairEvent):
    """Spheres collide with a restitution that depends on pressure; they bond if it reaches twice their
    hardness.

        e = max(1 - |I_n| / (2 a min(H_i, H_j)), 0)                   restitution            (3.1)
        |I_n| = m_ij v_n^2 / (2 beta min(b_i, b_j))                   mean normal force      (4.10)
        a = (a_0 + (a_f - a_0)(1 - e)) pi min(b_i, b_j)^2             contact area           (4.12)

    v_n is the speed of approach, m_ij = m_i m_j / (m_i + m_j) the reduced mass, b the radius and H the
    hardness. ``impacts`` counts collisions, ``contacts`` the steps in which forces have pressed a pair in
    contact, ``bonds`` the pairs that have bonded.

    Source: Z04 Eqs (2.1)-(2.5), (3.1), (4.10), (4.12), (4.17), staggering scheme of section 6b.
    """

    hard: ClassVar[bool] = True
    fields = ("radius", "mass", "velocity")
    depends_on_velocity: ClassVar[bool] = True
    world_fields = tuple(
        WorldField(name, "counter") for name in ("impacts", "contacts", "bonds", "iterations", "unconverged")
    )
    forced: ClassVar[bool] = False

    hardness: float = parameter(
        "Pa",
        "Vickers hardness H_0 of the grains; with softening, the limit at high temperature",
        examples=[3e5],
        gt=0,
    )
    deformation_length: float = parameter(
        "", "deformation beta in an impact, over the smaller radius", 1.0, gt=0
    )
    initial_area: float = parameter(
        "", "contact area a_0 of a lossless rebound (e = 1), over pi min(b)^2", 0.0, ge=0
    )
    final_area: float = parameter("", "contact area a_f of a bond (e = 0), over pi min(b)^2", 1.0, gt=0)
    tolerance: float = parameter(
        "", "change of e at which the coupling to temperature has converged", 1e-9, gt=0
    )
    max_iterations: int = option("largest number of iterations of the coupling to temperature", 200, ge=1)

    @model_validator(mode="after")
    def _areas(self) -> Self:
        must(
            self.final_area >= self.initial_area,
            "impact.final_area",
            "at least initial_area",
            self.final_area,
        )
        return self

    def connect(self, peers: Peers) -> dict[str, Any]:
        laws = peers.of(ImpactLaw)
        offered = {hook: tuple(law for law in laws if law.data.offers(hook)) for hook in HOOKS}
        return {**offered, "forced": bool(peers.of(Force, PairForce))}

    @ti.func
    def contact(self, s, w, i, j, separation):
        """Return the time (s) since the surfaces met, overlap over approach speed; negative unless both are
        positive."""
        closing = (s.velocity[w, i] - s.velocity[w, j]).dot(separation)
        reach = s.radius[w, i] + s.radius[w, j]
        due = ti.cast(-1.0, s.real)
        if closing > 0.0 and separation.norm_sqr() <= reach * reach:
            rest = rounding(s, w, i, j, separation)
            if closing > rest:
                distance = separation.norm()
                due = (reach - distance) * distance / closing
        return due

    @ti.func
    def hardness_at(self, w, temperature):
        h = self.hardness(w)
        for law in ti.static(self.hardness_factor):
            h *= law.hardness_factor(w, temperature)
        return h

    @ti.func
    def bonding(self, w, pressure, hardness):
        """Return x = 1 - e from the force over 2 pi min(b)^2 (Pa), by the quadratic equation above in a form
        without cancellation."""
        a0, d = self.initial_area(w), self.final_area(w) - self.initial_area(w)
        p = pressure / hardness
        x = 0.0 * p
        # False for a NaN, which must not bond, and for values that underflow.
        if p > 0.0:
            x = ti.min(1.0, 2.0 * p / (a0 + ti.sqrt(a0 * a0 + 4.0 * d * p)))
        return x

    @ti.func
    def tangential(self, w, reduced, v_n, v_t, x):
        """Return the tangential impulse (N s): it stops the slip if the pair bonds; otherwise it is the
        friction impulse, never more than stops the slip."""
        stop = reduced * v_t
        impulse = stop
        if x < 1.0:
            impulse = 0.0 * stop
            for law in ti.static(self.limit):
                impulse += law.limit(w, reduced * v_n * (2.0 - x))
        return ti.min(impulse, stop)

    @ti.func
    def lost(self, w, reduced, v_n, v_t, x):
        """Return the kinetic energy (J) that the pair loses."""
        e, slip = 1.0 - x, v_t - self.tangential(w, reduced, v_n, v_t, x) / reduced
        return 0.5 * reduced * ((1.0 - e * e) * v_n * v_n + v_t * v_t - slip * slip)

    @ti.func
    def supplied(self, w, reduced, v_n, smaller, x):
        """Return the energy (J) that the impact laws give each grain."""
        energy = 0.0 * x
        for law in ti.static(self.supply):
            energy += law.supply(w, self.area(w, smaller, x), self.work(reduced, v_n, x))
        return energy

    @ti.func
    def work(self, reduced, v_n, x):
        """Return the work of deformation (Z04 4.7-4.9; see heating.py), in J."""
        e = 1.0 - x
        return reduced * v_n * v_n * (1.0 - e * e) / 3.0

    @ti.func
    def area(self, w, smaller, x):
        a0 = self.initial_area(w)
        return (a0 + (self.final_area(w) - a0) * x) * ti.math.pi * smaller * smaller

    @ti.func
    def solve_restitution(self, s, w, i, j, reduced, v_n, v_t, smaller):
        """Return x = 1 - e at which hardness, heat and restitution agree."""
        pressure = reduced * v_n * v_n / (4.0 * ti.math.pi * self.deformation_length(w) * smaller**3)
        x = ti.cast(1.0, s.real)
        if ti.static(len(self.hardness_factor) == 0):
            x = self.bonding(w, pressure, self.hardness(w))
        else:
            share_i = s.mass[w, j] / (s.mass[w, i] + s.mass[w, j])
            change, k = ti.cast(1.0, s.real), 0
            while change > self.tolerance(w) and k < self.max_iterations:
                energy = self.supplied(w, reduced, v_n, smaller, x)
                loss = self.lost(w, reduced, v_n, v_t, x)
                softest = ti.cast(ti.math.inf, s.real)
                for law in ti.static(self.temperature):
                    t_i = law.temperature(s, w, i, energy + share_i * loss)
                    t_j = law.temperature(s, w, j, energy + (1.0 - share_i) * loss)
                    softest = ti.min(self.hardness_at(w, t_i), self.hardness_at(w, t_j))
                new = self.bonding(w, pressure, softest)
                change, x, k = ti.abs(new - x), new, k + 1
            ti.atomic_add(s.iterations[w], k)
            if change > self.tolerance(w):
                ti.atomic_add(s.unconverged[w], 1)
        return x

    @ti.func
    def resolve(self, s, w, i, j, separation):
        if ti.static(self.forced):
            if rests(s, w, i, j, separation):
                support(self, s, w, i, j, separation)
            else:
                self.collide(s, w, i, j, separation)
        else:
            self.collide(s, w, i, j, separation)

    @ti.func
    def collide(self, s, w, i, j, separation):
        m_i, m_j = s.mass[w, i], s.mass[w, j]
        reduced = m_i * m_j / (m_i + m_j)
        smaller = ti.min(s.radius[w, i], s.radius[w, j])
        n = separation.normalized()
        slip = s.velocity[w, i] - s.velocity[w, j]
        v_n = slip.dot(n)
        slip -= v_n * n
        v_t = slip.norm()

        x = self.solve_restitution(s, w, i, j, reduced, v_n, v_t, smaller)
        impulse = reduced * v_n * (2.0 - x) * n
        if v_t > 0.0:
            impulse += self.tangential(w, reduced, v_n, v_t, x) * slip / v_t
        s.velocity[w, i] = s.velocity[w, i] - impulse / m_i
        s.velocity[w, j] = s.velocity[w, j] + impulse / m_j
        if x >= 1.0:
            common = s.velocity[w, i] + m_j / (m_i + m_j) * (s.velocity[w, j] - s.velocity[w, i])
            s.velocity[w, i], s.velocity[w, j] = common, common
        ti.atomic_add(s.impacts[w], 1)

        loss = self.lost(w, reduced, v_n, v_t, x)
        lost_i, lost_j = loss * m_j / (m_i + m_j), loss * m_i / (m_i + m_j)
        energy = self.supplied(w, reduced, v_n, smaller, x)
        for law in ti.static(self.temperature):
            s.temperature[w, i] = law.temperature(s, w, i, energy + lost_i)
            s.temperature[w, j] = law.temperature(s, w, j, energy + lost_j)
        for law in ti.static(self.supply):
            energies = law.supply(w, self.area(w, smaller, x), self.work(reduced, v_n, x))
            law.book(s, w, i, energies)
            law.book(s, w, j, energies)
        broken = 0
        for law in ti.static(self.fracture):
            broken += law.fracture(s, w, i, lost_i)
            broken += law.fracture(s, w, j, lost_j)
        if x >= 1.0 and broken == 0:
            ti.atomic_add(s.bonds[w], 1)
            for law in ti.static(self.bond):
                law.bond(s, w, i, j, separation)
