"""The virial of the forces between particles, from which the stress follows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product
from typing import ClassVar

import numpy as np

from tisim.effects.base import Effect, LongRange, PairEvent, PairForce
from tisim.effects.constraint.rigid_clumps import RigidClumps
from tisim.forces.loads import VIRIAL

NAMES = tuple(f"virial_{a}{b}" for a, b in product("xyz", "xyz"))
"""Names of the measures of a world, in the order of the field."""


class Virial(Effect):
    """The virial of all pair forces is summed together with the forces in each step.

        W = sum_(i<j) (r_i - r_j) F_ij,    W_ab is a product of component a of the place and b of the force

    F_ij is the force on i by j, and r_i - r_j leads to i from the image of j that acts on it. W is positive
    if particles repel each other; over the volume it is the contribution of pair forces to the pressure
    tensor. It is asymmetric if pairs exert torques on each other, such as dipoles in a field.

    Each particle has half of the virial of each of its pairs as a field ``virial``, nine values in the order
    xx, xy, xz, yx, ... zz; the sums are measures ``virial_xx`` ... ``virial_zz``.
    ``tisim.analysis.stress_tensor`` adds the contribution of the motion of particles and divides by the
    volume.

    Forces on single particles, such as walls, gravity and drag, are not included, nor are the forces that
    hold particles in a prescribed motion. The effect excludes rigid clumps and sudden impacts, whose internal
    forces are unknown, and long-range sums by waves or by a tree, whose forces are not known pair by pair.
    Forces are taken at the end of the step, as in ``force``.

    Source: R. Clausius, Ann. Phys. 217 (1870) 124; A. P. Thompson, S. J. Plimpton, W. Mattson, J. Chem. Phys.
    131 (2009) 154107, for periodic systems.
    """

    fields = (VIRIAL,)
    requires = (PairForce,)
    excludes: ClassVar = (PairEvent, RigidClumps, LongRange)

    def measures(self, state: Mapping[str, np.ndarray]) -> dict[str, float]:
        # Exactly rounded sums do not depend on the order.
        return dict(zip(NAMES, map(math.fsum, state["virial"].T), strict=True))

    def measured(self) -> dict[str, str]:
        return dict.fromkeys(NAMES, "J")
