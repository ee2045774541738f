"""Tangential springs with memory, up to Coulomb's limit."""

from __future__ import annotations

import math
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.granular.parts import TangentialForce
from tisim.effects.contact.granular.spring import slipping, unloaded
from tisim.materials.materials import Touching


class TangentialSpring(TangentialForce):
    """This is the contract of a tangential spring that is a part of the normal one, beside a dashpot.

    F_t = T + gamma_t u,    |F_t| <= mu N,    S_t = kappa S_n,    gamma_t = sqrt(kappa) gamma_n
    """

    contract: ClassVar[bool] = True
    uses: ClassVar[tuple[str, ...]] = ("friction",)

    def ratio(self, pair: Touching) -> float:
        """Return kappa, the tangential stiffness over the normal one."""
        raise NotImplementedError(f"{type(self).__name__} must define ratio")

    def mix(self, pair: Touching) -> dict[str, float]:
        ratio = self.ratio(pair)
        return {"share": ratio, "drag": math.sqrt(ratio), "slope": pair.mixed("friction")}

    @ti.func
    def spring(self, w, pair, stiffness):
        return self.share(w, pair) * stiffness

    @ti.func
    def dashpot(self, w, pair, damping):
        return self.drag(w, pair) * damping

    @ti.func
    def coulomb(self, w, pair):
        return self.slope(w, pair)


class MindlinForce(TangentialSpring):
    """Surfaces stick as Mindlin found, by a spring whose force is remembered, and slide after Coulomb.

        F_t = T + gamma_t u,    dT/dt = S_t u,    |F_t| <= mu N,    S_t = 4 G*/E* S_n

    S_t is 8 G* a beside Hertz's force. T turns with the pair; while surfaces slide it is what Coulomb's limit
    leaves of it; and it falls as S_t does while they are unloaded, as a spring that is lighter holds less.
    Without that a contact that is pressed, sheared, unloaded and sheared back would yield work. It is
    ``mindlin_rescale/force`` of LAMMPS.

    Source: R. D. Mindlin, J. Appl. Mech. 16 (1949) 259, in the incremental form of O. R. Walton and R. L.
    Braun, J. Rheol. 30 (1986) 949, unloaded as by C. Thornton, S. J. Cummins and P. W. Cleary, Powder
    Technol. 210 (2011) 189.
    """

    memory: ClassVar[int] = 4
    vector: ClassVar[bool] = True
    uses: ClassVar = ("young", "poisson", "friction")

    def ratio(self, pair: Touching) -> float:
        return 4 * pair.effective_shear / pair.effective_young

    @ti.func
    def force(self, w, pair, normal, stiffness, damping, limit, sliding, past, dt):
        spring = self.spring(w, pair, stiffness)
        elastic = unloaded(spring, past[3]) * ti.Vector([past[0], past[1], past[2]])
        elastic += spring * dt * sliding
        drag = self.dashpot(w, pair, damping) * sliding
        grip, known = slipping(elastic, drag, self.coulomb(w, pair) * limit)
        return grip, ti.Vector([known[0], known[1], known[2], spring])


class DisplacementSpring(TangentialSpring):
    """This is the contract of a tangential spring whose displacement is remembered."""

    contract: ClassVar[bool] = True
    memory: ClassVar[int] = 3
    vector: ClassVar[bool] = True

    @ti.func
    def force(self, w, pair, normal, stiffness, damping, limit, sliding, past, dt):
        spring = self.spring(w, pair, stiffness)
        drawn = ti.Vector([past[0], past[1], past[2]]) + dt * sliding
        drag = self.dashpot(w, pair, damping) * sliding
        grip, known = slipping(spring * drawn, drag, self.coulomb(w, pair) * limit)
        # Where the spring is none, as at no overlap, nothing is drawn.
        drawn = ti.select(spring > 0.0, known / spring, 0.0)
        return grip, drawn


class MindlinDisplacement(DisplacementSpring):
    """Surfaces stick as Mindlin found, by a spring whose displacement is remembered, and slide after Coulomb.

        F_t = S_t xi + gamma_t u,    dxi/dt = u,    |F_t| <= mu N,    S_t = 4 G*/E* S_n

    It is ``mindlin`` of LAMMPS. A contact that is sheared, pressed and sheared back yields work, half of what
    S_t has grown by times xi^2; ``mindlin_force`` does not.

    Source: R. D. Mindlin, J. Appl. Mech. 16 (1949) 259.
    """

    uses: ClassVar = ("young", "poisson", "friction")

    def ratio(self, pair: Touching) -> float:
        return 4 * pair.effective_shear / pair.effective_young


class LinearSpring(DisplacementSpring):
    """Surfaces stick by a spring that is a given part of the normal one, and slide after Coulomb.

        F_t = kappa S_n xi + sqrt(kappa) gamma_n u,    dxi/dt = u,    |F_t| <= mu N

    It is the companion of Hooke's normal force, ``linear_history`` of LAMMPS.

    Source: P. A. Cundall and O. D. L. Strack, Geotechnique 29 (1979) 47; J. Schaefer, S. Dippel and D. E.
    Wolf, J. Phys. I 6 (1996) 5, for 2/7.
    """

    stiffness_ratio: float = parameter(
        "", "tangential stiffness over the normal one, kappa; at 2/7 both swing alike", 2 / 7, gt=0
    )

    def ratio(self, pair: Touching) -> float:
        return self.stiffness_ratio
