"""Sums over all other particles that are computed by separate phases, not pair by pair."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from tisim.effects.base.effect import Effect

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.program.phases import Item
    from tisim.state.bound import Bound
    from tisim.state.state import State


class LongRangeSum(ABC):
    """A long-range sum is computed for all particles of a world together, such as by a tree of cells or by
    waves.

    It is a ``ti.data_oriented`` object with its own device memory, in which kernels find its result.
    """

    @abstractmethod
    def phases(self) -> tuple[Item, ...]:
        """Return the items that compute the sum of the present state, which may be a trial state.

        They read positions, other fields and derived quantities that have been set before; they write only
        the memory of the sum. The result may depend neither on the order of parallel work nor on previous
        contents: it is computed anew in each force evaluation. The first items are ``AtStage``, as for all
        sums that appear several times in a step: they run only if there is something to do, and request the
        repeated items. Items must terminate even if positions are not finite; the forces then report the
        error.
        """

    @abstractmethod
    def bytes(self) -> int:
        """Return the device memory, in bytes."""


class LongRange(Effect):
    """This is the contract of an effect that computes a long-range sum, which its other hooks read, such as
    the ``force`` of a ``Force``.

    The sum is computed after derived quantities are set and before forces are summed. For a
    ``SelfConsistentQuantity`` it is computed in each sweep, before the sum over pairs, from the values at the
    beginning of the sweep. In kernels it is ``self.sum`` of the bound effect. Particles that interact in this
    way are not stepped one by one.
    """

    contract: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False

    def long_range_sum(self, own: Bound[LongRange], s: State, domain: Bound[Domain]) -> LongRangeSum:
        """Return the object that computes the sum in a state; ``own`` is the bound effect, ``domain`` the
        bound domain."""
        raise NotImplementedError(f"{type(self).__name__} must define long_range_sum")
