"""Fields that are switched on and off in the course of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.errors import must
from tisim.sources.base import Source

NO_END = 1e30
"""s, end of a field that is never switched off."""


class Switched(Source):
    """The contract of a field that acts from ``begin`` until ``end`` (s)."""

    contract: ClassVar[bool] = True

    if TYPE_CHECKING:
        begin: float
        end: float

    @model_validator(mode="after")
    def _ends_after_it_begins(self) -> Switched:
        rule = f"after {self.label}.begin, {self.begin:g} s"
        must(self.end > self.begin, f"{self.label}.end", rule, self.end)
        return self

    @property
    def kinked(self) -> bool:  # type: ignore[override]
        """Return whether the field is switched on or off in the course of a run."""
        return self.begin > 0 or self.end < NO_END

    def structure(self) -> tuple[Any, ...]:
        # Steppers may be compiled differently for forces with kinks.
        return (*super().structure(), self.kinked)

    @ti.func
    def acts(self, w, t):
        """Return whether the field acts at time t (s)."""
        return t >= self.begin(w) and t < self.end(w)
