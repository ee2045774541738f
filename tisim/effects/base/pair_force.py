"""Forces between two particles, and their contact history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import is_device_function, ti
from tisim.domains.domain import Domain
from tisim.effects.base.effect import Effect
from tisim.effects.base.pairwise import Pairwise


def kinks(effects: Sequence[Effect], domain: Domain) -> list[str]:
    """Return the labels of the parts of a scene whose forces have or may have kinks or jumps."""
    kinked = [effect.label for effect in effects if effect.has_kinks()]
    if any(domain.imaged()) and any(isinstance(effect, PairForce) for effect in effects):
        # Forces have a kink at distances where the nearest image changes.
        kinked.append(domain.label)
    return kinked


def keeps_apart(effects: Sequence[Effect]) -> bool:
    """Return whether a scene has a contact law with history, which is far stiffer than attractive forces."""
    return any(isinstance(one, PairForce) and one.solid and one.leapfrog for one in effects)


class PairForce(Pairwise):
    """A pair force acts between two particles, along any direction, and equals its reaction.

        pair_force(i, j) = -pair_force(j, i)

    Most laws define ``pair_force``, and ``pair_torque`` if they exert torques. A short-ranged law whose
    force, torques and history belong together, such as a contact law, defines ``interaction`` instead.

    memory : number of history values of a pair, kept while the pair is within ``reach``; zero for a new pair.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    memory: ClassVar[int] = 0

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # Unknown for a law that does not define it.
        return None

    def turns(self, effects: Sequence[Effect]) -> bool:
        """Return whether it exerts torques, given its options and all effects of the scene."""
        return self.offers("pair_torque") or self.offers("interaction")

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        """Return the force on i by j, in N; ``separation`` is r_j - r_i (m), ``distance`` its length.

        The distance is 0 if both particles are at the same place. A law that has a finite limit there must
        return it. A law that divides by the distance returns a value that is not finite; the world then stops
        and names the law.
        """
        return 0.0 * separation

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        """Return ``pair_force`` given 1/distance (1/m); 0 if 1/distance is 0.

        A law that uses the distance in no other way may define this method too: in fast arithmetic, sums over
        all pairs then compute roots and divisions in advance. A subclass that changes the law, ``pair_force``
        or a function that it calls, must redefine this method; otherwise it is not used.
        """
        return 0.0 * separation

    @classmethod
    def offers_inverse(cls) -> bool:
        """Return whether ``pair_force_by_inverse`` is valid for this class: no subclass of its defining class
        has changed a device function."""
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
        """Return the force on i by j (N), the torques on i and on j about their centres (N m), and the new
        history of the pair, given its history ``past`` and the time ``dt`` (s) since it was updated.

        It is called for listed pairs within ``reach``. i is the particle of lower id, and the history is
        expressed from the viewpoint of i. ``past`` is a vector of ``memory`` values; if there are none it is
        a single 0, returned unchanged. The method writes nothing: several pairs are computed at once, and
        some twice. Use ``ti.select`` rather than branches for speed.
        """
        force = self.pair_force(s, w, i, j, separation, distance, t)
        turn = self.pair_torque(s, w, i, j, separation, distance, t)
        back = self.pair_torque(s, w, j, i, -separation, distance, t)
        return force, turn, back, past
