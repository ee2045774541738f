"""The contract of an operator: what changes the state between steps.

An operator is an effect (see tisim/effects/base). ``particle`` is called for each particle on its own, and
may write only that particle; then ``world`` is called once per world, serially, where ``acts`` says so, and
may add particles, remove them, and end the world. What it needs of all particles is summed before, in
parallel: ``each`` returns ``terms`` of a particle, and ``self.sums.total(w)`` their sums. What else is long
for one thread follows in phases of its own, ``world_action``. One that defines neither ``world`` nor that
leaves a stepper free to take each particle through many steps by itself.
"""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, option, parameter
from tisim.program.phases import WorldAction
from tisim.state.bound import Bound
from tisim.state.state import State

__all__ = ["Operator", "WorldAction", "option", "parameter"]


class Operator(Effect):
    """An operator changes the state between steps.

    any_order : whether it does the same to a world in whatever order particles are in memory, but for
    rounding; then large worlds may be sorted by place.
    terms : so many numbers of each particle are summed for ``world``.
    """

    contract: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False
    any_order: ClassVar[bool] = False
    terms: ClassVar[int] = 0

    @classmethod
    def acts_on_worlds(cls) -> bool:
        """Return whether it changes a world as a whole, not each particle by itself alone."""
        return cls.offers("world") or cls.offers("world_action")

    def world_action(self, own: Bound[Any], s: State) -> WorldAction | None:
        """Return what it does to a world after ``world`` in phases of its own, if anything; ``own`` is the
        bound operator, which kernels find it in as ``self.action``."""
        return None

    @ti.func
    def particle(self, s, w, i, t, dt):
        """Change particle i alone, after a step of dt seconds that ends at t (s, f64).

        ``s.time[w]`` is not that of a particle that takes steps of its own.
        """

    @ti.func
    def acts(self, s, w):
        """Return whether ``world`` has something to do after this step; what pairs remember is put in store
        before it does."""
        return 1

    @ti.func
    def each(self, s, w, i):
        """Return the ``terms`` of particle i, a vector of f64; may change and remove that particle alone. It
        is asked of all particles at once, before ``world``, other than those that have been removed in this
        step."""
        return ti.Vector.zero(ti.f64, self.terms)

    @ti.func
    def world(self, s, w):
        """Change the world as a whole, serially, after pair events; may append and remove.

        ``self.sums.total(w)`` are the sums of the ``terms``, in an order that is always the same. A loop over
        particles belongs into ``each``.
        """
