"""Tangential springs with history, up to Coulomb's limit."""

from __future__ import annotations

import math
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.granular.parts import TangentialForce
from tisim.effects.contact.granular.spring import slipping, unloaded
from tisim.materials.materials import Touching


class TangentialSpring(TangentialForce):
    """This is the contract of a tangential spring and dashpot in fixed ratio to the normal ones.

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
    """Mindlin's tangential spring, whose force is remembered, lets surfaces stick up to Coulomb's limit.

        F_t = T + gamma_t u,    dT/dt = S_t u,    |F_t| <= mu N,    S_t = 4 G*/E* S_n

    With Hertz's force S_t is 8 G* a. T rotates with the pair. While surfaces slide, T is the part that
    Coulomb's limit leaves of it. During unloading T decreases in proportion to S_t, as a softer spring holds
    less force; otherwise a contact that is pressed, sheared, unloaded and sheared back would produce work. It
    is ``mindlin_rescale/force`` of LAMMPS.

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
        # Without a spring, as at zero overlap, there is no displacement.
        drawn = ti.select(spring > 0.0, known / spring, 0.0)
        return grip, drawn


class MindlinDisplacement(DisplacementSpring):
    """Mindlin's tangential spring, whose displacement is remembered, lets surfaces stick up to Coulomb's
    limit.

        F_t = S_t xi + gamma_t u,    dxi/dt = u,    |F_t| <= mu N,    S_t = 4 G*/E* S_n

    It is ``mindlin`` of LAMMPS. A contact that is sheared, pressed and sheared back produces work: half the
    increase of S_t times xi^2. ``mindlin_force`` does not.

    Source: R. D. Mindlin, J. Appl. Mech. 16 (1949) 259.
    """

    uses: ClassVar = ("young", "poisson", "friction")

    def ratio(self, pair: Touching) -> float:
        return 4 * pair.effective_shear / pair.effective_young


class LinearSpring(DisplacementSpring):
    """A tangential spring in fixed ratio to the normal one lets surfaces stick up to Coulomb's limit.

        F_t = kappa S_n xi + sqrt(kappa) gamma_n u,    dxi/dt = u,    |F_t| <= mu N

    It is the companion of Hooke's normal force, ``linear_history`` of LAMMPS.

    Source: P. A. Cundall and O. D. L. Strack, Geotechnique 29 (1979) 47; J. Schaefer, S. Dippel and D. E.
    Wolf, J. Phys. I 6 (1996) 5, for 2/7.
    """

    stiffness_ratio: float = parameter(
        "", "tangential over normal stiffness, kappa; at 2/7 both have the same period", 2 / 7, gt=0
    )

    def ratio(self, pair: Touching) -> float:
        return self.stiffness_ratio
