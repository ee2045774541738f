"""Resistance to rolling: by a constant torque, and by springs with history."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.granular.parts import RollingResistance
from tisim.effects.contact.granular.spring import slipping, unloaded
from tisim.materials.materials import Touching


class RollingCDT(RollingResistance):
    """A constant directional torque resists rolling at any speed.

        M = mu_r R* N,    against the relative spin across the normal

    It jumps when rolling changes its direction, so that grains at rest jitter by the rolling of one step. It
    has no spring and sets no limit to the step.

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
    """An elastic-plastic spring and a dashpot resist rolling.

        M = R* F,    F = T + gamma v_r,    dT/dt = k v_r,    |F| <= mu_r N
        k = 9/4 mu_r^2 S_n,    gamma = 2 eta sqrt(k m*)

    v_r is R* times the relative spin across the normal. T rotates with the pair, and during unloading it
    decreases in proportion to k, as in ``mindlin_force``. Beyond the limit the origin of the spring is
    dragged along. The damping ratio refers to m* on the spring.

    Source: K. Iwashita and M. Oda, J. Eng. Mech. 124 (1998) 285, as type C of J. Ai, J.-F. Chen, J. M. Rotter
    and J. Y. Ooi, Powder Technol. 206 (2011) 269, who use the inertia of both grains for the damping.
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
    """A spring, a dashpot and a slider with independent constants resist rolling.

        M = R* F,    F = k_r xi + gamma_r v_r,    dxi/dt = v_r,    |F| <= mu_r N

    v_r is R* times the relative spin across the normal. xi rotates with the pair; beyond the limit its origin
    is dragged along. It is ``rolling sds`` of LAMMPS.

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
