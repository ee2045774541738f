"""Parts of a scene with a direction."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar, Self

from pydantic import model_validator

from tisim.components.component import Component
from tisim.components.ranges import check_direction


class Directed(Component):
    """A part with a vector of any length that gives a direction; kernels read the unit vector.

    along : the name of the vector parameter. unit : the name of the unit vector.
    """

    contract: ClassVar[bool] = True
    along: ClassVar[str] = "direction"
    unit: ClassVar[str] = "axis"

    @model_validator(mode="after")
    def _directed(self) -> Self:
        check_direction(f"{self.label}.{self.along}", getattr(self, self.along))
        return self

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield cls.unit, 3

    def values(self) -> list[float]:
        return [*super().values(), *self.unit_vector()]

    def unit_vector(self) -> list[float]:
        """Return the unit vector."""
        vector = getattr(self, self.along)
        length = math.hypot(*vector)
        return [component / length for component in vector]
