"""The common base of forces between particles and self-consistent quantities: sums over pairs."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base.effect import Effect


class Pairwise(Effect):
    """This is the contract of sums over pairs.

    short_ranged : whether it is zero if the gap between surfaces is wider than ``reach``. It is then summed
    over the pair list, otherwise over all pairs. within_bodies : whether a short-ranged law also acts between
    particles of one rigid body, as a truncated sum over all pairs does. truncated : whether ``reach`` is a
    cut-off of a law that would extend further. Far more pairs are then within it than touch, and contact laws
    are not evaluated for these. solid : whether it keeps touching spheres apart. A world is stopped if a step
    is so long that spheres may pass through each other.
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
        """Return its interaction range: the widest gap (m) between surfaces at which it acts between i and a
        particle no larger than i.

        For a pair the value of the larger particle is used. ``assert_reach`` of tisim/testing checks that the
        range is long enough.
        """
        return 0.0
