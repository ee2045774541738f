"""The interface of a case: a package in ``cases`` with a ``CASE``. Cases are discovered; there is no
registry.

A ``CASE`` names its figures, checks and inverse problem as ``Late``, so that listing the cases is fast. Its
checks yield a ``Check`` for a number, a ``Claim`` for a mean of random runs, and ``Shown`` for a number
without a verdict.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tisim import InputError, Scene, cases
from tisim.accuracy import Quantity
from tisim.analysis import Mean
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.io.reader import Frames
from tisim.numerics.statistics import CONFIDENCE
from tisim.optimize.problem.problem import Problem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tisim.report.spectrum import Spectrum


@dataclass(frozen=True)
class Check:
    """A number that a case must reproduce; it passes if |measured - expected| <= bound."""

    name: str
    measured: float
    expected: float
    bound: float

    @property
    def ok(self) -> bool:
        return abs(self.measured - self.expected) <= self.bound

    @property
    def number(self) -> float:
        """The measured value."""
        return self.measured

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Return measured value, expected value, deviation and bound as text for a table."""
        off = abs(self.measured - self.expected)
        return f"{self.measured:.10g}", f"{self.expected:.10g}", f"{off:.1e}", f"{self.bound:.1e}"


@dataclass(frozen=True)
class Claim:
    """A statement about random runs; it holds if the whole confidence interval is within least..most."""

    name: str
    mean: Mean
    least: float = -np.inf
    most: float = np.inf

    @property
    def ok(self) -> bool:
        return (
            self.least <= self.mean.value - self.mean.half and self.mean.value + self.mean.half <= self.most
        )

    @property
    def number(self) -> Mean:
        """The mean, with its interval."""
        return self.mean

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Return mean, bounds, an empty cell and the confidence level as text for a table."""
        bounds = [f"above {self.least:.4g}"] * bool(np.isfinite(self.least))
        bounds += [f"below {self.most:.4g}"] * bool(np.isfinite(self.most))
        return str(self.mean), ", ".join(bounds), "", f"{CONFIDENCE:.0%} confidence"


@dataclass(frozen=True)
class Shown:
    """A number that is shown with a value from elsewhere, without a verdict."""

    name: str
    value: float | Mean
    beside: str = ""
    ok: ClassVar[None] = None

    @property
    def number(self) -> float | Mean:
        """The value."""
        return self.value

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Return the number and the value shown beside it as text for a table."""
        return str(self.value) if isinstance(self.value, Mean) else f"{self.value:.4g}", self.beside, "", ""


@dataclass(frozen=True)
class Size:
    """A size of a case.

    summary : description for users. scene : settings of the scene that differ from the defaults.
    search : settings of the search; None if the inverse problem is not available in this size.
    """

    summary: str
    scene: Mapping[str, Any]
    search: Mapping[str, Any] | None = None


def size_named(name: str, sizes: Mapping[str, Size]) -> Size:
    """Return a size by name; InputError if there is no such size."""
    must(name in sizes, "size", f"one of {', '.join(sizes)}", name)
    return sizes[name]


def searched_size(name: str, sizes: Mapping[str, Size]) -> Size:
    """Return a size by name that has a search; InputError if there is no such size, or if it has no
    search."""
    searched = [key for key, one in sizes.items() if one.search is not None]
    must(name in searched, "size", f"one of {', '.join(searched)} for the inverse problem", name)
    return sizes[name]


@dataclass(frozen=True)
class Late:
    """A function of a case's module; the module is imported at the first call."""

    module: str
    name: str

    @property
    def function(self) -> Callable[..., Any]:
        """The function itself; reading it imports the module."""
        return getattr(importlib.import_module(self.module), self.name)

    def __call__(self, *arguments: Any) -> Any:
        return self.function(*arguments)


@dataclass(frozen=True)
class Case:
    """A runnable scenario, with its inverse problem if it has one.

    name : of the package. title, source : for users. sizes : by name; "default" is among them.
    scene : (size, seed) -> Scene.
    check : runs the checks and yields each number when it is known, including numbers that are only shown.
    quantities : the quantities that 'tisim cost' compares in a scene of the case; None for its defaults.
    cost_size : the size that 'tisim cost' uses if none is given; None for "default".
    problem : (size, variant) -> Problem; variants : its names, the first the default.
    calibration : (size, variant, file) -> Problem, the same problem with the measurements in a file as
    target.
    pictures : pictures of a run drawn from its trajectory, by file name. spectra : spectra of a run computed
    from its trajectory, for its report.
    scenes : (size, seed) -> Scene of the variants that do not use ``scene``, by name.
    figures : (size, progress) -> figures, and tables as text, that need many runs; by file name.
    """

    name: str
    title: str
    source: str
    sizes: Mapping[str, Size]
    scene: Callable[[str, int], Scene]
    check: Callable[[], Iterator[Check | Claim | Shown]]
    problem: Callable[[str, str], Problem] | None = None
    variants: tuple[str, ...] = ()
    quantities: Callable[[Scene], tuple[Quantity, ...]] | None = None
    cost_size: str | None = None
    pictures: Callable[[Frames], Mapping[str, Figure]] | None = None
    spectra: Callable[[Frames], Sequence[Spectrum]] | None = None
    figures: Callable[[str, Progress], Mapping[str, Figure | str]] | None = None
    calibration: Callable[[str, str, Path], Problem] | None = None
    scenes: Mapping[str, Callable[[str, int], Scene]] = field(default_factory=dict)

    def size(self, name: str) -> Size:
        """Return a size by name; InputError if there is no such size."""
        return size_named(name, self.sizes)

    def scene_of(self, size: str, seed: int, variant: str | None = None) -> Scene:
        """Return the scene of a size and a seed; of a variant, if one is given.

        InputError if there is no size of that name, or no scene of that variant.
        """
        self.size(size)
        if variant is None:
            return self.scene(size, seed)
        rule = (
            f"one of {', '.join(self.scenes)}" if self.scenes else f"left out, as {self.name} has one scene"
        )
        must(variant in self.scenes, "variant", rule, variant)
        return self.scenes[variant](size, seed)

    def inverse(
        self, size: str, variant: str | None, measured: Path | None = None
    ) -> tuple[Problem, Mapping[str, Any]]:
        """Return the inverse problem (its first variant for None), and the settings of its search.

        measured : a file of measurements that replaces the case's own target.
        InputError if the case has no inverse problem, has none of that size, or takes no measurements.
        """
        self.size(size)
        if self.problem is None:
            raise InputError(f"case must be one with an inverse problem; received {self.name!r}")
        search = searched_size(size, self.sizes).search
        assert search is not None
        chosen = next(iter(self.variants), "") if variant is None else variant
        rule = f"one of {', '.join(self.variants)}"
        must(chosen in self.variants or not self.variants, "variant", rule, chosen)
        if measured is None:
            return self.problem(size, chosen), search
        if self.calibration is None:
            raise InputError(
                f"--measured must be given for a case that is calibrated; received {self.name!r}"
            )
        return self.calibration(size, chosen, measured), search


def every() -> dict[str, Case]:
    """Return all cases by their names."""
    found = pkgutil.iter_modules(cases.__path__, f"{cases.__name__}.")
    modules = (importlib.import_module(module.name) for module in found)
    return {module.CASE.name: module.CASE for module in modules if hasattr(module, "CASE")}
