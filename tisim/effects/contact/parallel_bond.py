"""Cemented grains: bonds that carry forces and moments, and break."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.effects.base import Effect, PairForce, parameter
from tisim.effects.base.critical_step import SLIDING, critical_step, smallest_grains
from tisim.effects.contact.granular.spring import carried, tilted
from tisim.effects.contact.granular.step_limit import can_follow, can_follow_both, least_mass
from tisim.numerics.vectors import piece


@ti.func
def swung(rate, normal, tilt, turn):
    """Return a rate across the line of centres midway in a step, rotated with the bond to the end of the
    step: by half of its rotation (see ``carried``), which is arctan(turn) about the normal."""
    known = rate - rate.dot(normal) * (normal + tilt)
    return (known + turn * normal.cross(known)) / ti.sqrt(1.0 + turn * turn)


@ti.func
def reduced(one, other):
    """Return the reduced mass (kg), or moment of inertia (kg m^2), of two bodies."""
    return one * (other / (one + other))


class ParallelBond(PairForce):
    """Grains that are close to each other at the start are cemented by bonds, which carry forces and moments
    and break.

        F_n = k_n A (d - d_0),    dF_s/dt = k_s A u_s,    dM_n/dt = k_s J Omega_n,    dM_s/dt = k_n I Omega_s
        k_n = E / (R_i + R_j),    k_s = k_n / kappa,    A = pi r^2,    I = pi r^4 / 4,    J = 2 I
        breaks if F_n / A + |M_s| r / I > sigma_c or |F_s| / A + |M_n| r / J > tau_c

    A bond is a disc of cement of radius r = lambda min(R_i, R_j); a chain of bonds is an elastic beam. d_0 is
    the distance of the centres at the start, u_s the relative velocity of the surfaces midway between them,
    and Omega the relative spin; the index n stands for along the line of centres, s for across it. The stored
    force and moment rotate with the pair. A law that pushes touching grains apart, such as ``granular``, may
    act in addition.

    Damping uses the effective masses of both grains: in a rigid body the mass of the body; a held body counts
    as a wall. In steps beyond k dt^2 + 2 c dt = 4 m, with the stiffness k, damping c and reduced mass m of
    any of the four springs, the motion of a pair would oscillate and grow: the force is then not a number,
    and the world stops. For shear 1/m is 1/m_i + 1/m_j + l_i^2/I_i + l_j^2/I_j with the arms l and moments of
    inertia I, as sheared grains also rotate. In rows energy grows at shorter steps already, in a long row
    from 0.71 of this limit.

    Source: D. O. Potyondy and P. A. Cundall, Int. J. Rock Mech. Min. Sci. 41 (2004) 1329, Eqs (9)-(15).
    """

    short_ranged: ClassVar[bool] = True
    fields = ("radius", "velocity", "spin")
    depends_on_velocity: ClassVar[bool] = True
    # It breaks.
    smooth: ClassVar[bool] = False
    leapfrog: ClassVar[bool] = True
    guards_steps: ClassVar[bool] = True
    # This step control ignores the stiffness of bonds.
    incompatible_controls = ("approach_time",)
    memory: ClassVar[int] = 8

    gap: float = parameter("m", "widest gap between surfaces at which bonds form at the start", 0.0)
    young: float = parameter("Pa", "Young's modulus E of the cement", examples=[1e9], gt=0)
    stiffness_ratio: float = parameter("", "normal over shear stiffness, kappa", 2.5, gt=0)
    radius_ratio: float = parameter(
        "", "radius of the cement over the radius of the smaller grain, lambda", 1.0, gt=0
    )
    tensile_strength: float = parameter("Pa", "tensile strength sigma_c", examples=[1e7], gt=0)
    shear_strength: float = parameter("Pa", "shear strength tau_c", examples=[1e7], gt=0)
    damping_ratio: float = parameter("", "damping of each spring over its critical damping", 0.0, ge=0)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        shortest = math.inf
        for _, mass, radius in smallest_grains(start):
            stiffness = self.young / (2 * radius) * math.pi * (self.radius_ratio * radius) ** 2
            # Sheared grains also rotate.
            stiffest = stiffness * max(1.0, SLIDING / self.stiffness_ratio)
            shortest = min(shortest, critical_step(stiffest, 0.5 * mass))
        return shortest

    def failure_hint(self, effects: Sequence[Effect], domain: Domain) -> str:
        return "a step is too long for the springs and dashpots of a bond"

    @ti.func
    def reach(self, s, w, i):
        # A bond that is stretched further than this has broken.
        strain = self.tensile_strength(w) / self.young(w)
        return ti.max(self.gap(w), 0.0) + 2.0 * strain * s.radius[w, i]

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        a, b = s.radius[w, i], s.radius[w, j]
        normal = (1.0 / distance) * separation
        arm = 0.5 * (a - b + distance)
        back = distance - arm
        passing = s.relative_velocity(w, i, j, separation)
        # Velocities are midway in the step, at which the distance vector of the centres is this.
        half = separation - 0.5 * dt * passing
        apart = half.norm()
        middle = half / apart
        halfway, start = tilted(middle, normal), tilted((half - 0.5 * dt * passing).normalized(), normal)
        begins = (t <= 0.0) & (distance <= a + b + self.gap(w))
        rest = ti.select(past[0] > 0.0, past[0], distance)

        lever, turn = 0.5 * (a - b + apart), 0.25 * dt * (s.spin[w, i] + s.spin[w, j]).dot(middle)
        surfaces = passing - (lever * s.spin[w, i] + (apart - lever) * s.spin[w, j]).cross(middle)
        opening, rolling = surfaces.dot(middle), s.spin[w, j] - s.spin[w, i]
        twisting = rolling.dot(middle)
        sliding = swung(surfaces - opening * middle, normal, halfway, turn)
        bending = swung(rolling - twisting * middle, normal, halfway, turn)

        r = self.radius_ratio(w) * ti.min(a, b)
        area, second = ti.math.pi * r * r, 0.25 * ti.math.pi * r * r * r * r
        stiff = self.young(w) / (a + b)
        soft = stiff / self.stiffness_ratio(w)
        shear = carried(piece(past, 1, 3), normal, start, turn) + soft * area * dt * sliding
        moment = carried(piece(past, 4, 3), normal, start, turn) + stiff * second * dt * bending
        twist = past[7] + 2.0 * soft * second * dt * twisting
        pull = stiff * area * (distance - rest)

        tension = pull / area + moment.norm() * r / second
        shearing = shear.norm() / area + ti.abs(twist) * r / (2.0 * second)
        whole = (tension <= self.tensile_strength(w)) & (shearing <= self.shear_strength(w))
        holds = ((past[0] > 0.0) | begins) & whole

        m, n, free = s.masses_behind(w, i, j)
        inertia, other = 0.4 * m * a * a, 0.4 * n * b * b
        mass, turning = reduced(m, n), reduced(inertia, other)
        # A shear force moves and rotates both grains.
        sheared = 1.0 / mass + arm * arm / inertia + back * back / other
        twice = 2.0 * self.damping_ratio(w)
        along, across = twice * ti.sqrt(stiff * area * mass), twice * ti.sqrt(soft * area * mass)
        bent = twice * ti.sqrt(stiff * second * turning)
        twisted = twice * ti.sqrt(2.0 * soft * second * turning)
        force = (pull + along * opening) * normal + shear + across * sliding
        couple = moment + bent * bending + (twist + twisted * twisting) * normal
        # In a longer step stretching, shear, bending or twisting would oscillate and grow.
        follows = can_follow(least_mass(stiff * area, along, dt), free / mass)
        follows = follows & can_follow(least_mass(2.0 * soft * second, twisted, dt), free / turning)
        shears, bends = least_mass(soft * area, across, dt), least_mass(stiff * second, bent, dt)
        # Between unlike grains shear and bending are coupled.
        coupled = free * (arm / inertia - back / other)
        follows = follows & can_follow_both(shears, bends, free * sheared, free / turning, coupled)
        force = ti.select(follows, force, ti.math.nan)

        force, couple = ti.select(holds, force, 0.0), ti.select(holds, couple, 0.0)
        moved = normal.cross(force)
        known = ti.Vector([rest, shear[0], shear[1], shear[2], moment[0], moment[1], moment[2], twist])
        return (
            force,
            arm * moved + couple,
            back * moved - couple,
            ti.select(holds, known, 0.0),
        )
