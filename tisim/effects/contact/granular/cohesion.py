"""Cohesion while surfaces touch."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.parts import Cohesion, Overlap
from tisim.materials.materials import Touching


class SJKR(Cohesion):
    """Grains attract each other with a force proportional to the contact area, after a simplified JKR model.

        F = k_c A,    A = 2 pi R* delta

    A is the area of the lens that two spheres share, to first order in delta / R*. Coulomb's limit uses the
    normal force without cohesion.

    The elastic force must exceed the cohesion. Beside ``hooke`` it does so at all overlaps or at none: if 2
    pi k_c R* exceeds the stiffness k, grains collapse into each other. Beside ``hertz_material`` two grains
    without load rest at delta = (3 pi k_c / (2 E*))^2 R*. If this is above R*, for k_c > 2 E* / (3 pi), the
    contact circle would be wider than R* and the area above loses its meaning. Both cases are detected by
    comparing the forces at an overlap of R*. Grains of a start or of an insertion, and walls, are refused if
    cohesion is not below the elastic force there; a world is stopped if grains grow to such a size.

    Source: L21 section 2.2.1; C. Kloss, C. Goniva, A. Hager, S. Amberger and S. Pirker, Prog. Comput. Fluid
    Dyn. 12 (2012) 140, for its use.
    """

    uses: ClassVar = ("cohesion_energy_density",)
    by_overlap: ClassVar[bool] = True

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"density": pair.mixed("cohesion_energy_density")}

    def pulls(self, pair: Touching, radius: float | np.ndarray, overlap: Overlap) -> Overlap:
        pull: Any = 2 * math.pi * pair.mixed("cohesion_energy_density") * radius * overlap
        return pull

    @ti.func
    def pull(self, w, pair, radius, overlap):
        return 2.0 * ti.math.pi * self.density(w, pair) * radius * overlap


class DMT(Cohesion):
    """Hard grains attract each other with a constant force while they touch, after Derjaguin, Muller and
    Toporov.

        F = 4 pi gamma R*

    gamma is the surface energy, half the work of adhesion. Every normal force can balance a constant force:
    beside ``hertz_material`` two grains without load rest at delta = (3 pi gamma / (E* R*))^(2/3) R*.
    Coulomb's limit uses |F_n + 2 F|, with F_n the sum of elastic and cohesive force, so that it is mu F when
    the contact is about to part. The force sets in and ends at its full value when surfaces touch or part.
    There it is ramped over two steps, so that its work does not depend on when within a step this happens
    (jump.py).

    Source: B. V. Derjaguin, V. M. Muller and Y. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314; L21 Eq.
    (4.5); J. S. Marshall, J. Comput. Phys. 228 (2009) 1541, for the limit.
    """

    adhesive: ClassVar[bool] = True
    jumps: ClassVar[bool] = True
    uses: ClassVar = ("surface_energy",)

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"line": 4 * math.pi * pair.mixed("surface_energy")}

    def pulls(self, pair: Touching, radius: float | np.ndarray, overlap: Overlap) -> Overlap:
        pull: Any = 4 * math.pi * pair.mixed("surface_energy") * radius + 0.0 * overlap
        return pull

    @ti.func
    def pull(self, w, pair, radius, overlap):
        return self.line(w, pair) * radius
