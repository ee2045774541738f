"""Contact of rough elastic spheres: Hertz's normal force, Mindlin's tangential force with its history."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.granular import GranularContact

NO_GRIP = 1e-30
"""Contacts below this radius, m, hold nothing."""
TURN = 1e-12
"""What a pair remembers turns with it; its square is not corrected by less than this part of it."""


class HertzMindlin(GranularContact):
    """Grains push each other apart as Hertz found, stick after Mindlin, slide after Coulomb, and lose energy.

        F_n = 4/3 E* a delta - c sqrt(S_n m*) v_n,       a^2 = R* delta,    S_n = 2 E* a
        F_t = T + c sqrt(S_t m*) u,    dT/dt = S_t u,    |F_t| <= mu |F_n|, S_t = 8 G* a
        c = -2 sqrt(5/6) ln e / sqrt(ln^2 e + pi^2)

    delta is the overlap, v_n the speed at which the surfaces separate, and u the velocity of the surface of j
    past that of i at their point of contact, spin included. 1/R* = 1/R_i + 1/R_j and 1/m* = 1/m_i + 1/m_j;
    of one material, E* = E / (2 (1 - nu^2)) and G* = E / (4 (2 - nu) (1 + nu)). The contact lies in the
    middle of the overlap. With this c an impact along the line of centres has the restitution e at any speed;
    the force then pulls a little before the surfaces part.

    The elastic part T of the tangential force is what a contact remembers. It turns with the pair; while they
    slide it is what Coulomb's limit leaves of it; and it falls as a does while they are eased, as a grip that
    is lighter holds less. Without that a contact that is pressed, sheared, eased and sheared back would yield
    work.

    An impact at a speed v lasts 2.94 (15 m* / (16 E* sqrt(R* v)))^(2/5); a fiftieth of that as a step gives
    its restitution to 0.004. In a step beyond 2 sqrt(m* / S_n) the overlap would alternate and grow: the
    force is then not a number, and the world stops.

    Source: H. Hertz (1882); R. D. Mindlin, J. Appl. Mech. 16 (1949) 259, in the incremental force form of
    O. R. Walton and R. L. Braun, J. Rheol. 30 (1986) 949, eased as by C. Thornton, S. J. Cummins and P. W.
    Cleary, Powder Technol. 210 (2011) 189; Y. Tsuji, T. Tanaka and T. Ishida, Powder Technol. 71 (1992) 239,
    with the c of D. Antypov and J. A. Elliott, EPL 94 (2011) 50004.
    """

    memory: ClassVar[int] = 4

    young: float = parameter("Pa", "Young's modulus E of the material", examples=[1e7], gt=0)
    poisson: float = parameter("", "Poisson's ratio nu of the material", examples=[0.25], gt=-1, le=0.5)
    restitution: float = parameter("", "coefficient e of restitution", examples=[0.5], gt=0, le=1)
    friction: float = parameter("", "coefficient mu of friction", examples=[0.5], ge=0)

    @property
    def effective_young(self) -> float:
        """Return E* of two grains of the material, Pa."""
        return self.young / (2 * (1 - self.poisson**2))

    @property
    def effective_shear(self) -> float:
        """Return G* of two grains of the material, Pa."""
        return self.young / (4 * (2 - self.poisson) * (1 + self.poisson))

    @property
    def damping(self) -> float:
        """Return the factor c of the damping, which gives an impact its restitution."""
        logarithm = math.log(self.restitution)
        return -2 * math.sqrt(5 / 6) * logarithm / math.hypot(logarithm, math.pi)

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield from (("stiff", 1), ("soft", 1), ("loss", 1), ("drag", 1))

    def values(self) -> list[float]:
        normal, tangential = 2 * self.effective_young, 8 * self.effective_shear
        losses = (self.damping * math.sqrt(stiffness) for stiffness in (normal, tangential))
        return [*super().values(), normal, tangential, *losses]

    @ti.func
    def contact(self, w, normal, overlap, radius, mass, slip, past, dt):
        opening = slip.dot(normal)
        sliding = slip - opening * normal

        circle = ti.sqrt(radius * overlap)
        inertia = ti.sqrt(circle * mass)
        press = 2.0 / 3.0 * self.stiff(w) * circle * overlap - self.loss(w) * inertia * opening
        # Beyond this step the overlap would alternate and grow.
        press = ti.select(self.stiff(w) * circle * dt * dt < 4.0 * mass, press, ti.math.nan)
        drag = self.drag(w) * inertia * sliding

        elastic = ti.Vector([past[0], past[1], past[2]])
        # A lighter grip holds less; at constant T more would come back than was put in.
        elastic *= ti.min(circle / ti.max(past[3], NO_GRIP), 1.0)
        # What is remembered turns with the pair: into the plane of contact, with its size.
        out, size = elastic.dot(normal), elastic.norm_sqr()
        known = elastic - out * normal
        if out * out > TURN * size and out * out < size:
            known *= ti.sqrt(size / (size - out * out))
        known += self.soft(w) * circle * dt * sliding
        grip, limit = known + drag, self.friction(w) * ti.abs(press)
        square = grip.norm_sqr()
        if square > limit * limit:
            grip *= limit / ti.sqrt(square)
            known = grip - drag
        return grip - press * normal, ti.Vector([known[0], known[1], known[2], circle])
