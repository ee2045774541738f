"""Forces between magnetic moments in a periodic box, with all their images."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, PairForce
from tisim.effects.magnetic.ewald_pairs import EwaldPairs
from tisim.effects.magnetic.moment import MOMENT
from tisim.effects.magnetic.permanent_moment import PermanentMoment
from tisim.effects.magnetic.wave_sum import WaveSum

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.effects.base import LongRange, LongRangeSum
    from tisim.state.bound import Bound, Peers
    from tisim.state.state import State


class EwaldDipoleDipole(EwaldPairs, Force, PairForce):
    """Magnetic moments attract, repel and rotate each other as dipoles, with all periodic images (Ewald sum).

        F_i = -grad_i U,    T_i = m_i x B_i,    B_i = -dU / dm_i

    U is the energy of all dipoles of a periodic box with their images, and m the ``moment`` that another
    effect has set, held fixed. The torques T act on permanent moments. ``ewald_settings`` returns settings
    for a given ``accuracy`` of the forces. In ``dipole_dipole`` only nearest images act. The law corresponds
    to lj/cut/dipole/long with ewald/disp in LAMMPS. Momentum is conserved to rounding, since the forces of
    each wave sum to zero. Energy is conserved up to the jumps at the cut-off, which are of the order of the
    accuracy.

    ``demagnetising_factors`` describe the shape of the sample that contains the box; 0 if applied fields are
    the fields inside the sample, as between the poles of a yoke.

    Source: the sources of ``ewald_induced_moment``; B16 Eqs (6.21), (6.23), L21 Eqs (4.8), (4.9).
    """

    fields = (MOMENT,)

    def turns(self, effects: Sequence[Effect]) -> bool:
        return any(isinstance(effect, PermanentMoment) for effect in effects)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {**super().connect(peers), "permanent": bool(peers.of(PermanentMoment))}

    def long_range_sum(self, own: Bound[LongRange], s: State, domain: Bound[Domain]) -> LongRangeSum:
        return WaveSum(s, own, domain, forces=True)

    @ti.func
    def force(self, s, w, i, t):
        return self.sum.force[w, i]

    @ti.func
    def torque(self, s, w, i, t):
        torque = 0.0 * s.moment[w, i]
        if ti.static(self.permanent):
            torque = s.moment[w, i].cross(self.sum.field[w, i])
        return torque

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return self.near_force(s, w, i, j, separation, distance)

    @ti.func
    def pair_torque(self, s, w, i, j, separation, distance, t):
        torque = 0.0 * separation
        if ti.static(self.permanent):
            torque = s.moment[w, i].cross(self.near_field(s, w, j, separation, distance))
        return torque
