"""The contract of a case: a package in ``cases`` with a ``CASE``. Found by looking; registered nowhere.

A ``CASE`` names its figures, checks and inverse problem as ``Late``, so that listing the cases stays quick.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tisim.cases.statistics import Claim, Shown
from tisim.optimize.problem.problem import Problem

from tisim import InputError, Scene, cases
from tisim.accuracy import Quantity
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.io.reader import Frames

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Check:
    """A number that a case must reproduce: right when |measured - expected| <= bound."""

    name: str
    measured: float
    expected: float
    bound: float

    @property
    def ok(self) -> bool:
        return abs(self.measured - self.expected) <= self.bound

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Measured, expected, off by, allowed; for people."""
        off = abs(self.measured - self.expected)
        return f"{self.measured:.10g}", f"{self.expected:.10g}", f"{off:.1e}", f"{self.bound:.1e}"


@dataclass(frozen=True)
class Size:
    """How large a case is run.

    summary : for people. scene : its settings that differ. search : those of the search; None where the
    inverse problem is not of this size.
    """

    summary: str
    scene: Mapping[str, Any]
    search: Mapping[str, Any] | None = None


def size_named(name: str, sizes: Mapping[str, Size]) -> Size:
    """Return a size by name; InputError when there is none of that name."""
    must(name in sizes, "size", f"one of {', '.join(sizes)}", name)
    return sizes[name]


def searched_size(name: str, sizes: Mapping[str, Size]) -> Size:
    """Return a size by name of which a case has a search; InputError when there is none of that name, or no
    search of it."""
    searched = [key for key, one in sizes.items() if one.search is not None]
    must(name in searched, "size", f"one of {', '.join(searched)} for the inverse problem", name)
    return sizes[name]


@dataclass(frozen=True)
class Late:
    """A function of a case's module that is imported when it is called first."""

    module: str
    name: str

    @property
    def function(self) -> Callable[..., Any]:
        """The function itself, for which its module is imported."""
        return getattr(importlib.import_module(self.module), self.name)

    def __call__(self, *arguments: Any) -> Any:
        return self.function(*arguments)


@dataclass(frozen=True)
class Case:
    """A runnable scenario, and the inverse problem on it where there is one.

    name : of the package. title, source : for people. sizes : by name; "default" is among them.
    scene : (size, seed) -> Scene. check : runs what must hold and yields each number as it is known, also
    those that are only shown.
    quantities : what 'tisim cost' compares in a scene of the case; None for what it takes by itself.
    cost_size : the size that 'tisim cost' takes unless one is given; None for "default".
    problem : (size, variant) -> Problem; variants : its names, the first the default.
    calibration : (size, variant, file) -> Problem, the same for measurements that a file has.
    pictures : what the case is about, drawn from a run's trajectory; by name of file.
    scenes : (size, seed) -> Scene of those variants that are not about ``scene``, by name.
    figures : (size, progress) -> what takes many runs: figures, and tables as text; by name of file.
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
    figures: Callable[[str, Progress], Mapping[str, Figure | str]] | None = None
    calibration: Callable[[str, str, Path], Problem] | None = None
    scenes: Mapping[str, Callable[[str, int], Scene]] = field(default_factory=dict)

    def size(self, name: str) -> Size:
        """Return a size by name; InputError when there is none of that name."""
        return size_named(name, self.sizes)

    def scene_of(self, size: str, seed: int, variant: str | None = None) -> Scene:
        """Return the scene of a size and a seed; of a variant, where one is given.

        InputError when there is no size of that name, or no scene of that variant.
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

        measured : a file of measurements that it is to meet, in place of the case's own.
        InputError when the case has none, or not of that size, or takes no measurements.
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
