"""Constraints: inequalities on a quantity of a run, or on the design itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from tisim.errors import is_number, must


@dataclass(frozen=True)
class InequalityConstraint:
    """An inequality: a quantity that must not exceed, or fall below, a bound. A feasible design satisfies
    all.

    name : heading in tables; unit : of the values, "" if there is none.
    of : function that returns the value in that unit; its argument depends on the kind of constraint.
    at_most, at_least : the bounds, one or both; a value equal to a bound is allowed.
    scale : the excess that counts the same as an excess of 1 of another constraint; None for the magnitude of
        the bound, or 1 if the bound is 0. It only affects the ranking of infeasible designs.
    InputError for an empty name, for no bound, and for bounds that allow no value.
    """

    name: str
    of: Callable[[Any], float]
    unit: str = ""
    at_most: float | None = None
    at_least: float | None = None
    scale: float | None = None

    def __post_init__(self) -> None:
        what = f"constraint {self.name}"
        must(isinstance(self.name, str) and bool(self.name.strip()), "constraint name", "a non-empty string",
             self.name)  # fmt: skip
        must(callable(self.of), f"function 'of' of {what}", "a function of a result or a design", self.of)
        must(bool(self.bounds), what, "at_most or at_least a number, or both", None)
        for bound in self.bounds:
            must(is_number(bound) and math.isfinite(bound), f"bound of {what}", "a finite number", bound)
        if self.at_most is not None and self.at_least is not None:
            must(self.at_least < self.at_most, f"at_least of {what}", "below at_most", self.at_least)
        positive = self.scale is None or (is_number(self.scale) and 0 < self.scale < math.inf)
        must(positive, f"scale of {what}", "a finite number above 0", self.scale)

    kind: ClassVar[str]

    @property
    def bounds(self) -> tuple[float, ...]:
        """The given bounds."""
        return tuple(bound for bound in (self.at_least, self.at_most) if bound is not None)

    @property
    def rule(self) -> str:
        """The allowed values, in words: "at most 3 kg"."""
        named = (("at least", self.at_least), ("at most", self.at_most))
        words = [f"{side} {bound:.10g}" for side, bound in named if bound is not None]
        return f"{' and '.join(words)} {self.unit}".rstrip()

    @property
    def label(self) -> str:
        """The name with unit and bounds, as a table heading."""
        return f"{self.name}, {self.rule}"

    @property
    def described(self) -> str:
        """A text of the rule and scale; part of the identity of a search."""
        scale = "" if self.scale is None else f", scale {self.scale!r}"
        ends = f"{self.at_least!r} to {self.at_most!r}"
        return f"{ends} {self.unit}".rstrip() + f", of the {self.kind}{scale}"

    def violation(self, value: float) -> float:
        """Return 0 for an allowed value, else its distance from the bound divided by ``scale``. Infinite for
        NaN."""
        if math.isnan(value):
            return math.inf
        below = 0.0 if self.at_least is None else (self.at_least - value) / self._scale(self.at_least)
        above = 0.0 if self.at_most is None else (value - self.at_most) / self._scale(self.at_most)
        return max(0.0, below, above)

    def _scale(self, bound: float) -> float:
        return self.scale or abs(bound) or 1.0


@dataclass(frozen=True)
class ResultConstraint(InequalityConstraint):
    """An inequality on a run: ``of`` takes its Result, or the FunctionResult of a plain function.

    The value that is compared is the mean over the random starts.
    """

    kind = "result"


@dataclass(frozen=True)
class DesignConstraint(InequalityConstraint):
    """An inequality on a design: ``of`` takes its values by name.

    It is checked before anything runs, so a design that violates it costs no run.
    """

    kind = "design"
