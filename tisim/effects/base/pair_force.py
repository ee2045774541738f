"""Forces between two particles, and what a pair remembers of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import is_device_function, ti
from tisim.domains.domain import Domain
from tisim.effects.base.effect import Effect
from tisim.effects.base.pairwise import Pairwise


def kinks(effects: Sequence[Effect], domain: Domain) -> list[str]:
    """Return the labels of the parts of a scene whose forces have kinks or jumps on the way, or may have."""
    kinked = [effect.label for effect in effects if effect.has_kinks()]
    if any(domain.imaged()) and any(isinstance(effect, PairForce) for effect in effects):
        # Where the nearest image becomes another.
        kinked.append(domain.label)
    return kinked


def keeps_apart(effects: Sequence[Effect]) -> bool:
    """Return whether a scene has a law of contact with a memory, which is far stiffer than what draws
    particles together."""
    return any(isinstance(one, PairForce) and one.solid and one.leapfrog for one in effects)


class PairForce(Pairwise):
    """A pair force acts between two particles, along any direction, and equals its reaction.

        pair_force(i, j) = -pair_force(j, i)

    Most laws define ``pair_force``, and ``pair_torque`` where they turn particles. A short-ranged law whose
    force, torques and memory belong together, such as that of a contact, defines ``interaction`` instead.

    memory : values that a pair remembers while it is within ``reach``, zero for a pair that has just met.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    memory: ClassVar[int] = 0

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # Not known of a law that does not say it.
        return None

    def turns(self, effects: Sequence[Effect]) -> bool:
        """Return whether it exerts torques, given its options and all effects of the scene."""
        return self.offers("pair_torque") or self.offers("interaction")

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        """Return the force on i by j, in N; ``separation`` is r_j - r_i (m), ``distance`` its length.

        Two particles in one place have a distance of 0. A law that has a limit there must return it; one that
        divides by the distance gives what is not finite, and the world stops and names the law.
        """
        return 0.0 * separation

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        """Return ``pair_force`` given 1/distance (1/m); 0 where that is 0.

        A law that needs no more of the distance may define it as well: sums over all pairs in fast arithmetic
        then make roots and divisions ahead. A subclass that changes the law, ``pair_force`` or what that
        calls, defines it anew, or is summed without it.
        """
        return 0.0 * separation

    @classmethod
    def offers_inverse(cls) -> bool:
        """Return whether ``pair_force_by_inverse`` is the law of this class: no class derived from the one
        that defines it has changed a device function."""
        classes = cls.__mro__
        definer = next(base for base in classes if "pair_force_by_inverse" in vars(base))
        later = classes[: classes.index(definer)]
        changed = (n for base in later for n, own in vars(base).items() if is_device_function(own))
        return cls.offers("pair_force_by_inverse") and not any(hasattr(definer, name) for name in changed)

    @ti.func
    def pair_torque(self, s, w, i, j, separation, distance, t):
        """Return the torque on i by j, about the centre of i, in N m."""
        return 0.0 * separation

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        """Return the force on i by j (N), the torques on i and on j about their centres (N m), and what the
        pair remembers from now on, given what it did, ``past``, and that ``dt`` (s) have gone by since.

        It is asked of listed pairs within ``reach``: i is the one of lower id, and what is remembered is as i
        sees it. ``past`` is a vector of ``memory`` values, or of one 0 where there are none, which is
        returned as it came. It writes nothing: several pairs are computed at once, and some twice. Choices
        (``ti.select``) are faster in it than branches.
        """
        force = self.pair_force(s, w, i, j, separation, distance, t)
        turn = self.pair_torque(s, w, i, j, separation, distance, t)
        back = self.pair_torque(s, w, j, i, -separation, distance, t)
        return force, turn, back, past
