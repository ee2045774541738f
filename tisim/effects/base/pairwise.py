"""What forces between particles and self-consistent quantities have in common: sums over pairs."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base.effect import Effect


class Pairwise(Effect):
    """This is the contract of what is summed over pairs.

    short_ranged : whether it is zero where the gap between surfaces is wider than ``reach``; it is then
    summed over the pair list, otherwise over all pairs. within_bodies : whether a short-ranged one acts
    between the particles of one rigid body as well, as what is a cut-off of a sum over all pairs does.
    truncated : whether ``reach`` is a cut-off of what would go on: far more pairs are within it than touch,
    and laws of contact are not asked of those. solid : whether it holds spheres apart that touch: a world in
    which a step is so long that they may pass through each other is stopped.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = False
    within_bodies: ClassVar[bool] = False
    truncated: ClassVar[bool] = False
    solid: ClassVar[bool] = False

    def reaches(self) -> bool:
        """Return whether it acts beyond contact at all, given its options."""
        return self.offers("reach")

    @ti.func
    def reach(self, s, w, i):
        """Return the widest gap (m) between surfaces at which it acts between i and a particle no larger.

        Of a pair it is the reach of the larger particle that counts, whatever the smaller one would return.
        ``assert_reach`` of tisim/testing tells whether it is long enough.
        """
        return 0.0
