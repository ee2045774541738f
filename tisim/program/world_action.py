"""What an operator does to a world in phases of its own, where one thread would take long."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tisim.program.phases import Item


class WorldAction(ABC):
    """A world action is what an operator does to a world in loops over its particles.

    It is a ``ti.data_oriented`` object with device memory of its own.
    """

    @abstractmethod
    def phases(self) -> tuple[Item, ...]:
        """Return the items of the action, which are taken in every step: a repeat that is pending only where
        there is something to do costs others next to nothing.

        What they come to may not depend on the order of parallel work.
        """

    @abstractmethod
    def bytes(self) -> int:
        """Return the device memory, in bytes."""
