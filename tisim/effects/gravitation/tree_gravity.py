"""Gravity between particles, summed with a tree of cells."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.constants import G

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import parameter
from tisim.effects.base import Effect, Force, LongRange, SceneParts
from tisim.effects.gravitation.tree_walk import TreeSum
from tisim.errors import must

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.state.bound import Bound
    from tisim.state.state import State


def fall_step(start: Mapping[str, np.ndarray]) -> float:
    """Return the critical step (s) of two particles in orbit around each other at contact; infinity without
    particles."""
    densest = float((start["mass"] / start["radius"] ** 3).max(initial=0.0))
    return 2 / math.sqrt(G * densest) if densest > 0 else math.inf


class TreeGravity(LongRange, Force):
    """Particles attract each other by gravity, which is summed over the cells of a tree.

        F_i = G m_i sum_c [M d / s^3 + (15/2 d.Q.d / s^7 - 3/2 tr Q / s^5) d - 3 Q d / s^5]

        s^2 = d^2 + eps^2,    Q = sum_k m_k x_k x_k^T,    |x_k| <= b < theta d

    The cost grows as N log N. d leads from particle i to the centre of mass of a cell, x_k from there to
    particle k of the cell, M is the mass of the cell and b the distance of its farthest particle. Nearer
    cells, with b >= theta d, are opened, down to leaves of 16 particles that are summed one by one; as theta
    goes to 0, all are. Without softening the error of a cell is at most

        (4 theta^3 - 3 theta^4) / (1 - theta)^2 G M m_i / d^2

    In a uniform ball the root mean square error of the forces is at most 0.012 theta^3 of the forces
    (docs/gravity.md). Forces are not equal and opposite: momentum and angular momentum are conserved only
    within the errors of the forces, while ``self_gravity``, which this effect approximates, conserves them to
    rounding. With ``softening_length`` it approximates ``softened_self_gravity``. A periodic box with images
    is refused.

    Source: J. Barnes, P. Hut, Nature 324 (1986) 446; the bound is from J. K. Salmon, M. S. Warren, J. Comput.
    Phys. 111 (1994) 136.
    """

    opening_angle: float = parameter(
        "", "opening angle theta; 0.5 gives a relative error of forces of about 0.001", 0.5, gt=0, lt=1
    )
    softening_length: float = parameter("m", "softening length eps; 0 for points", 0.0, ge=0)

    accuracy_parameters = (AccuracyParameter(opening_angle=3),)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        return fall_step(start)

    def check(self, scene: SceneParts) -> None:
        domain = scene.domain
        rule = f"one without periodic images, with effects.{self.label}"
        must(not any(domain.imaged()), domain.label, rule, domain.imaged())

    def long_range_sum(self, own: Bound[LongRange], s: State, domain: Bound[Domain]) -> TreeSum:
        return TreeSum(s, own)

    @ti.func
    def force(self, s, w, i, t):
        return s.mass[w, i] * self.sum.acceleration[w, i]
