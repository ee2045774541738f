"""Resistance to rolling: by a constant torque, and by springs with memory."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.granular.parts import RollingResistance
from tisim.effects.contact.granular.spring import slipping, unloaded
from tisim.materials.materials import Touching


class RollingCDT(RollingResistance):
    """A constant directional torque holds back two that roll on each other, at any speed.

        M = mu_r R* N,    against the relative spin across the normal

    It jumps where rolling changes its sense: grains at rest tremble, by a step's worth of rolling. As it is
    no spring, no step is too long for it.

    Source: Y. C. Zhou, B. D. Wright, R. Y. Yang, B. H. Xu and A. B. Yu, Physica A 269 (1999) 536, as type A
    of J. Ai, J.-F. Chen, J. M. Rotter and J. Y. Ooi, Powder Technol. 206 (2011) 269.
    """

    uses: ClassVar = ("rolling_friction",)

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"slope": pair.mixed("rolling_friction")}

    @ti.func
    def coulomb(self, w, pair):
        return self.slope(w, pair)

    @ti.func
    def force(self, w, pair, normal, stiffness, mass, limit, rolling, past, dt):
        speed = rolling.norm()
        share = ti.select(speed > 0.0, self.slope(w, pair) * limit / speed, 0.0)
        return share * rolling, past


class RollingEPSD(RollingResistance):
    """An elastic-plastic spring and a dashpot hold back two that roll on each other.

        M = R* F,    F = T + gamma v_r,    dT/dt = k v_r,    |F| <= mu_r N
        k = 9/4 mu_r^2 S_n,    gamma = 2 eta sqrt(k m*)

    v_r is R* times the relative spin across the normal. T turns with the pair and falls as k does while it is
    unloaded, as the force of ``mindlin_force`` does; past the limit its origin is dragged along. The damping
    is that of m* on the spring.

    Source: K. Iwashita and M. Oda, J. Eng. Mech. 124 (1998) 285, as type C of J. Ai, J.-F. Chen, J. M. Rotter
    and J. Y. Ooi, Powder Technol. 206 (2011) 269, who take the inertia of both grains for the damping.
    """

    memory: ClassVar[int] = 4
    vector: ClassVar[bool] = True
    uses: ClassVar = ("rolling_friction",)

    damping_ratio: float = parameter("", "damping over the critical one, eta", 0.3, ge=0)

    def mix(self, pair: Touching) -> dict[str, float]:
        friction = pair.mixed("rolling_friction")
        return {"slope": friction, "share": 2.25 * friction * friction}

    @ti.func
    def spring(self, w, pair, stiffness):
        return self.share(w, pair) * stiffness

    @ti.func
    def dashpot(self, w, pair, stiffness, mass):
        return 2.0 * self.damping_ratio(w) * ti.sqrt(self.share(w, pair) * stiffness * mass)

    @ti.func
    def coulomb(self, w, pair):
        return self.slope(w, pair)

    @ti.func
    def force(self, w, pair, normal, stiffness, mass, limit, rolling, past, dt):
        spring = self.spring(w, pair, stiffness)
        elastic = unloaded(spring, past[3]) * ti.Vector([past[0], past[1], past[2]])
        elastic += spring * dt * rolling
        drag = self.dashpot(w, pair, stiffness, mass) * rolling
        grip, known = slipping(elastic, drag, self.coulomb(w, pair) * limit)
        return grip, ti.Vector([known[0], known[1], known[2], spring])


class RollingSDS(RollingResistance):
    """A spring, a dashpot and a slider hold back two that roll on each other, with constants of their own.

        M = R* F,    F = k_r xi + gamma_r v_r,    dxi/dt = v_r,    |F| <= mu_r N

    v_r is R* times the relative spin across the normal. xi turns with the pair; past the limit its origin is
    dragged along. It is ``rolling sds`` of LAMMPS.

    Source: S. Luding, Granul. Matter 10 (2008) 235; Y. Wang, F. Alonso-Marroquin and W. W. Guo, Particuology
    23 (2015) 49.
    """

    memory: ClassVar[int] = 3
    vector: ClassVar[bool] = True
    uses: ClassVar = ("rolling_friction", "rolling_stiffness", "rolling_damping")

    def mix(self, pair: Touching) -> dict[str, float]:
        return {
            "slope": pair.mixed("rolling_friction"),
            "constant": pair.mixed("rolling_stiffness"),
            "drag": pair.mixed("rolling_damping"),
        }

    @ti.func
    def spring(self, w, pair, stiffness):
        return self.constant(w, pair)

    @ti.func
    def dashpot(self, w, pair, stiffness, mass):
        return self.drag(w, pair)

    @ti.func
    def coulomb(self, w, pair):
        return self.slope(w, pair)

    @ti.func
    def force(self, w, pair, normal, stiffness, mass, limit, rolling, past, dt):
        spring = self.spring(w, pair, stiffness)
        drawn = ti.Vector([past[0], past[1], past[2]]) + dt * rolling
        drag = self.dashpot(w, pair, stiffness, mass) * rolling
        grip, known = slipping(spring * drawn, drag, self.coulomb(w, pair) * limit)
        return grip, known / spring
