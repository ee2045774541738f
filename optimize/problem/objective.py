"""What a design is judged by: a quantity of its run, and whether much or little of it is wanted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tisim.errors import must


@dataclass(frozen=True)
class Objective:
    """A quantity that is to be made small, or large.

    name : heading in tables and plots; unit : of the values, "" if they have none.
    of : Result -> value in that unit, of a plain function FunctionResult -> value. Called for runs that ended
        well only; NaN and inf never win.
    Raises InputError for an empty name.
    """

    name: str
    of: Callable[[Any], float]
    unit: str = ""
    maximise: bool = False

    def __post_init__(self) -> None:
        must(bool(self.name.strip()), "objective name", "a non-empty string", self.name)

    @property
    def sign(self) -> float:
        """Cost = sign * value. A cost is minimised; the search knows costs only, people see values only."""
        return -1.0 if self.maximise else 1.0

    @property
    def label(self) -> str:
        """The name and the unit, as a heading."""
        return f"{self.name} ({self.unit})" if self.unit else self.name
