"""The interface of a search method: a class in a file of optimize/methods, or the user's own.

All subclasses are found automatically; no registration is needed.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

from tisim.components.component import Checked
from tisim.errors import must
from tisim.optimize import methods
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.problem.problem import checksum_of


class SearchMethod(ABC):
    """Proposes designs and is told their fitness.

    1. ``ask`` returns the individuals of the next generation, in the unit cube. Those without a valid fitness
       are estimated; those with one (parents that were kept) are not estimated again.
    2. ``tell`` receives all of them, all with a fitness (costs, to be minimised; +inf for failed ones), and
       the hall: the best designs so far, or the front. The objects are the same ones, but a fitness may have
       changed since, because more starts were spent on the design.
    3. ``learn`` receives individuals that the method did not ask for, between generations: designs of the
       user, which were run before generation 0, and designs with known values.
    4. The method has its own random numbers, determined by the seed alone. Its proposals are a function of
       the seed and of the fitnesses that it was told: a search is resumed by running it again from the
       beginning with the same cache.

    name : as in ``--method NAME``.
    several : whether it supports several objectives at once.
    own_starts : whether it works best if each design has its own random starts, instead of common ones. This
        applies to methods that fit a function through noisy means, because shared noise would bias the fit.
    takes_experiments : whether it can learn from designs that the search has not run. It never asks for a
        design given to ``learn``.
    ensemble : the method's own defaults for the settings of the ensemble.
    Options : its settings, as in ``--set search.options.KEY=VALUE``.
    dependent_options : option -> options whose defaults depend on it. If the user sets the option, a case's
        values of the dependent ones are dropped.
    width : mean width of the part of the unit cube that it currently draws from.
    moved : whether the last ``tell`` moved that part.
    """

    name: ClassVar[str]
    several: ClassVar[bool] = False
    own_starts: ClassVar[bool] = False
    takes_experiments: ClassVar[bool] = False
    ensemble: ClassVar[Mapping[str, Any]] = {}
    Options: ClassVar[type[Checked]]
    dependent_options: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    width: float = 1.0
    moved: bool = False

    @abstractmethod
    def __init__(self, genome: Genome, objectives: int, options: Any, seed: int) -> None:
        """Raise InputError for options that are invalid for the genome."""

    @classmethod
    def starts_of_its_own(cls, options: Any) -> bool:
        """Return whether it has own_starts with these options."""
        return cls.own_starts

    @abstractmethod
    def ask(self) -> list[Individual]:
        """Return the individuals of the next generation."""

    @abstractmethod
    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        """Learn the fitness of the individuals of the last ``ask``."""

    def learn(self, individuals: Sequence[Individual]) -> None:  # noqa: B027
        """Learn from individuals that it did not ask for, all with a fitness and all different.

        A method without this function sees them only through the hall.
        """


def every() -> dict[str, type[SearchMethod]]:
    """Return all search methods by name, from this package and from imported modules of the user.

    InputError if one of the user's cannot be used.
    """
    for entry in pkgutil.iter_modules(methods.__path__):
        importlib.import_module(f"{methods.__name__}.{entry.name}")
    kinds = [kind for kind in _made_after(SearchMethod) if not inspect.isabstract(kind)]
    by_name = {kind.name: kind for kind in kinds if _of_package(kind)}
    by_name = dict(sorted(by_name.items()))
    for kind in kinds:
        # A class that its module no longer contains is from a file that was reloaded since.
        if _of_package(kind) or vars(sys.modules.get(kind.__module__, object)).get(kind.__name__) is not kind:
            continue
        where = f"{kind.__module__}.{kind.__name__}"
        name, options = getattr(kind, "name", None), getattr(kind, "Options", None)
        must(isinstance(name, str) and bool(name), f"name of {where}", "a text", name)
        must(name not in by_name, f"name of {where}", "one that no other search method has", name)
        fit = isinstance(options, type) and issubclass(options, Checked)
        must(fit, f"Options of {where}", "a class made of tisim.components.component.Checked", options)
        by_name[str(name)] = kind
    return by_name


def find(name: str) -> type[SearchMethod]:
    """Return a method by name; InputError with the known names if there is none."""
    by_name = every()
    rule = f"one of {', '.join(by_name)}, or your own (--plugin, import)"
    must(isinstance(name, str) and name in by_name, "method", rule, name)
    return by_name[name]


def code_of(name: str) -> str:
    """Return a checksum of the code of a user's method; "" for one of this package, which has a version."""
    kind = find(name)
    return "" if _of_package(kind) else checksum_of(kind, f"method {name}")


def _of_package(kind: type) -> bool:
    return kind.__module__.startswith(f"{methods.__name__}.")


def _made_after(kind: type[Any]) -> Iterator[type[Any]]:
    for sub in kind.__subclasses__():
        yield sub
        yield from _made_after(sub)
