"""A hard case: why a scene is hard, the bounds of the numbers that it must give, and the run that measures
them."""

from __future__ import annotations

import importlib
import math
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tisim.cases.case import Late
from tisim.errors import InputError, RunError, RunWarning, StartWarning, abbreviated, did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HARD_FAMILIES = (
    "springs", "singular", "gyration", "moments", "ratios", "impacts", "reactions", "granular", "scales",
    "single_precision", "packings", "filters", "default_stepper",
)  # fmt: skip
"""The modules that define hard cases, in the order of ``tisim hard``."""


@dataclass(frozen=True)
class Criterion:
    """A number that a hard case measures, and the least and the most that it may be."""

    quantity: str
    most: float = math.inf
    least: float = -math.inf

    @property
    def allowed(self) -> str:
        """The allowed range as text: "at most 1e-06"."""
        if self.least == self.most:
            return f"{self.most:g}"
        if math.isinf(self.least):
            return f"at most {self.most:g}"
        return f"at least {self.least:g}" if math.isinf(self.most) else f"{self.least:g} to {self.most:g}"


@dataclass(frozen=True)
class Measured:
    """The number that came out of a run, beside its bound. reason : why there is no number, if a run
    failed."""

    bound: Criterion
    number: float
    reason: str = ""

    @property
    def ok(self) -> bool:
        """Whether the number is within its bound; NaN is not."""
        return self.bound.least <= self.number <= self.bound.most

    @property
    def measured(self) -> str:
        """The number as text, or the reason for having none."""
        # Without the sign of a negative zero.
        return self.reason or f"{self.number + 0.0:.3g}"


@dataclass(frozen=True)
class HardCase:
    """A scene that is hard to integrate.

    name : unique among all cases. family : name of its module.
    difficulty : why it is hard. bounds : the numbers that must hold.
    measure : runs the scene and returns the numbers in the order of the bounds.
    figure : returns a picture of it; None without one.
    """

    name: str
    family: str
    difficulty: str
    bounds: tuple[Criterion, ...]
    measure: Callable[..., Iterable[float]]
    figure: Callable[[], Figure] | None = None

    def run(self, *arguments: Any) -> list[Measured]:
        """Run the case and return its numbers beside their bounds.

        arguments : of ``measure``, for another stepper or law than the one of the case.
        A run that fails unexpectedly gives outcomes without a number, with the reason.
        """
        with warnings.catch_warnings():
            # Several cases start with overlaps on purpose, or read the state that a failed run has kept.
            for expected in (StartWarning, RunWarning):
                warnings.simplefilter("ignore", expected)
            try:
                numbers = [float(number) for number in self.measure(*arguments)]
            except RunError as failure:
                return [Measured(bound, math.nan, str(failure)) for bound in self.bounds]
        return [Measured(bound, number) for bound, number in zip(self.bounds, numbers, strict=True)]


_cases: dict[str, HardCase] = {}


def hard_case(
    difficulty: str, *bounds: Criterion, figure: str | None = None
) -> Callable[[Callable[..., Iterable[float]]], HardCase]:
    """Return a decorator that registers a function as the ``measure`` of a hard case of its name.

    figure : name of the function in ``figures`` that draws it.
    """

    def register(measure: Callable[..., Iterable[float]]) -> HardCase:
        family = measure.__module__.rpartition(".")[2]
        drawn = Late("tisim.cases.hard.figures", figure) if figure else None
        case = HardCase(measure.__name__, family, difficulty, bounds, measure, drawn)
        assert _cases.setdefault(case.name, case) is case, f"two hard cases are named {case.name}"
        return case

    return register


def hard_cases() -> dict[str, list[HardCase]]:
    """Return all hard cases, by family."""
    for family in HARD_FAMILIES:
        importlib.import_module(f"{__package__}.{family}")
    return {family: [one for one in _cases.values() if one.family == family] for family in HARD_FAMILIES}


def title(family: str) -> str:
    """Return the title of a family for users: the first line of the docstring of its module."""
    module = importlib.import_module(f"{__package__}.{family}")
    return (module.__doc__ or "").partition("\n")[0].rstrip(".")


def selected(names: Sequence[str]) -> list[HardCase]:
    """Return the cases of these names, of cases or of families, in their order; all for no names.

    InputError for a name that is neither.
    """
    families = hard_cases()
    every = [case for cases in families.values() for case in cases]
    known = [*families, *(case.name for case in every)]
    for name in names:
        if name not in known:
            rule = f"a family ({', '.join(families)}) or a case of 'tisim hard'"
            raise InputError(
                f"hard case must be {rule}; received {abbreviated(name)}{did_you_mean(name, known)}"
            )
    return [case for case in every if not names or {case.name, case.family} & set(names)]
