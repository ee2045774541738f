"""The contract of an operator, which changes the state between steps.

An operator is an effect (see tisim/effects/base). ``particle`` is called for each particle on its own and may
write only that particle. ``world`` is then called once per world, serially, if ``acts`` returns true; it may
add and remove particles, and end the world. Sums over all particles are formed before that, in parallel:
``each`` returns the ``terms`` of one particle, and ``self.sums.total(w)`` their sums. Work that would take
one thread long follows in phases of its own, ``world_action``. If an operator defines neither ``world`` nor
``world_action``, a stepper may take each particle through many steps by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, option, parameter
from tisim.errors import Words, must
from tisim.program.phases import WorldAction
from tisim.state.bound import Bound
from tisim.state.state import State

__all__ = ["AddsParticles", "Operator", "WorldAction", "option", "parameter"]


class Operator(Effect):
    """An operator changes the state between steps.

    any_order : whether the order of the particles in memory affects the result by rounding only; large worlds
    may then be sorted by place.
    terms : number of values per particle that are summed for ``world``.
    acts_on_fixed : whether ``particle`` must also be called for particles whose field ``fixed`` is not 0, by
    a stepper in which particles that do not interact take their own steps; they are then taken through the
    longest steps. Other steppers call it for all particles.
    """

    contract: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False
    any_order: ClassVar[bool] = False
    terms: ClassVar[int] = 0
    acts_on_fixed: ClassVar[bool] = False

    @classmethod
    def acts_on_worlds(cls) -> bool:
        """Return whether the operator changes a world as a whole, and not only each particle by itself."""
        return cls.offers("world") or cls.offers("world_action")

    def world_action(self, own: Bound[Any], s: State) -> WorldAction | None:
        """Return the phases in which the operator changes a world after ``world``, or None. ``own`` is the
        bound operator; kernels find the returned object as ``self.action``."""
        return None

    @ti.func
    def particle(self, s, w, i, t, dt):
        """Change particle i alone, after a step of dt seconds that ends at t (s, f64).

        ``s.time[w]`` is not the time of a particle that takes steps of its own.
        """

    @ti.func
    def acts(self, s, w):
        """Return whether ``world`` must be called after this step; contact histories are then stored
        beforehand."""
        return 1

    @ti.func
    def each(self, s, w, i):
        """Return the ``terms`` of particle i, a vector of f64; may change and remove that particle alone.
        Called in parallel for all particles before ``world``, except those that have been removed in this
        step."""
        return ti.Vector.zero(ti.f64, self.terms)

    @ti.func
    def world(self, s, w):
        """Change the world as a whole, serially, after pair events; may append and remove particles.

        ``self.sums.total(w)`` are the sums of the ``terms``, always summed in the same order. Loops over
        particles belong in ``each``.
        """


NONE_INSERTED: Mapping[str, np.ndarray] = {
    "radius": np.zeros(0),
    "material": np.zeros(0, int),
    "length": np.zeros(0),
}
"""The largest inserted particles of an operator that inserts none, or only copies."""


class AddsParticles(Operator):
    """An operator that adds particles in the course of a run."""

    contract: ClassVar[bool] = True

    def capacity(self, masses: np.ndarray) -> int:
        """Return the largest number of particles that may exist at once, given the masses at the start
        (kg)."""
        raise NotImplementedError

    def inserted_quantities(self) -> Mapping[str, np.ndarray] | None:
        """Return the fields that it sets on inserted particles beyond the common ones: SI values by field
        name, one row per class of particles. None, the default, if it inserts only copies."""
        return None

    def largest_inserted(self) -> Mapping[str, np.ndarray]:
        """Return the largest particles that it may insert: ``radius`` (m) and ``material`` (index) of the
        largest two of each class, or of one if it inserts only one, and ``length`` (m) of their clumps; by
        default none, for particles that are no larger than those present. Laws are checked against all pairs
        of them."""
        return NONE_INSERTED


def adding(effects: Iterable[Effect]) -> list[AddsParticles]:
    """Return the effects that add particles.

    Raises InputError for one that defines ``capacity`` without the base class: it would get no memory for its
    particles.
    """
    added = []
    for effect in effects:
        if isinstance(effect, AddsParticles):
            added.append(effect)
        else:
            rule = "of a class derived from AddsParticles, because it defines capacity"
            kind = type(effect)
            must(
                not callable(getattr(kind, "capacity", None)),
                f"effects.{effect.label}",
                rule,
                Words(kind.__name__),
            )
    return added


def largest_inserted(effects: Iterable[Effect]) -> Mapping[str, np.ndarray]:
    """Return the largest particles that effects may insert, as ``AddsParticles.largest_inserted`` does."""
    each = [NONE_INSERTED, *(effect.largest_inserted() for effect in adding(effects))]
    return {name: np.concatenate([one[name] for one in each]) for name in NONE_INSERTED}
