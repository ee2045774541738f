"""Sums over all other particles at once, made by phases of their own in place of a sum over pairs."""

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
    """A long-range sum is made for all particles of a world together, such as by a tree of cells or by waves.

    It is a ``ti.data_oriented`` object with device memory of its own, in which a kernel finds what it has
    come to.
    """

    @abstractmethod
    def phases(self) -> tuple[Item, ...]:
        """Return the items that make the sum of the state as it is, which may be a trial state.

        They read positions, other fields and derived quantities that are set before; they write nothing but
        the memory of the sum. What they come to may depend neither on the order of parallel work nor on what
        was there before: it is asked for anew in each force evaluation. The first ones are ``OnOccasion``, as
        all sums are that stand several times in a step, and ask for what is repeated. Where positions are not
        finite they must end all the same; what is not finite is left to the forces to show.
        """

    @abstractmethod
    def bytes(self) -> int:
        """Return the device memory, in bytes."""


class LongRange(Effect):
    """This is the contract of an effect that makes a long-range sum, from which its other hooks take what
    they return: the ``force`` of a ``Force``, for one.

    The sum is made before forces are summed, after derived quantities are set; that of a
    ``SelfConsistentQuantity`` in each of its sweeps, before what others do is summed over pairs, of the
    values that the sweep begins with. In kernels it is ``self.sum`` of the bound effect. Particles that feel
    each other so are not stepped one by one.
    """

    contract: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False

    def long_range_sum(self, own: Bound[LongRange], s: State, domain: Bound[Domain]) -> LongRangeSum:
        """Return what makes the sum in a state; ``own`` is the bound effect, ``domain`` likewise."""
        raise NotImplementedError(f"{type(self).__name__} must define long_range_sum")
