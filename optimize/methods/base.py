"""The contract of a search method: a file of optimize/methods, or of the user. It is found by looking and
registered nowhere."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

from tisim.optimize import methods
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.problem.problem import checksum_of

from tisim.components.component import Checked
from tisim.errors import must


class SearchMethod(ABC):
    """Proposes designs and is told what they are worth.

    1. ``ask`` gives the strings of the next generation, in the unit cube. Those whose fitness is not valid
       are estimated; those whose fitness is (parents that were kept) are not estimated again.
    2. ``tell`` gets all of them, all with a fitness (of costs, to be minimised; +inf for failed ones), and
       the hall: the best designs so far, or the front. Strings keep their identity: a fitness may have
       changed since, because more starts were spent on the design.
    3. ``learn`` gets strings that it has not asked for, between generations: designs of the user, which have
       run before generation 0, and designs whose worth is known.
    4. Its random numbers are its own and follow from the seed alone. What it asks is a function of the seed
       and of what it was told: to resume a search is to run it again from the start with the same cache.

    name : as in ``--method NAME``; several : whether it can search for several objectives at once.
    own_starts : whether it works best where each design has random starts of its own, and not the same as all
    others: a method that fits a function through noisy means is led astray by noise that they share.
    takes_experiments : whether it learns from designs that the search has not run: it asks for none of what
    ``learn`` has given it.
    ensemble : settings of the ensemble that are its own.
    Options : its settings, as in ``--set search.options.KEY=VALUE``. dependent_options : by option, those
    whose defaults depend on it: a case's own values of those go with its own value of this one.
    width : mean width of the part of the unit cube that it draws from now. moved : the last ``tell`` has put
    that part elsewhere.
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
        """Raise InputError for options that cannot work on the genome."""

    @classmethod
    def starts_of_its_own(cls, options: Any) -> bool:
        """Return whether it has own_starts with these options."""
        return cls.own_starts

    @abstractmethod
    def ask(self) -> list[Individual]:
        """Return the strings of the next generation."""

    @abstractmethod
    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        """Learn what the strings of the last ``ask`` are worth."""

    def learn(self, strings: Sequence[Individual]) -> None:  # noqa: B027
        """Take in strings that it has not asked for, all with a fitness and different. A method that does not
        say how knows of them by the hall alone."""


def every() -> dict[str, type[SearchMethod]]:
    """Return all search methods by their names: those of this package, and those of modules of the user that
    have been imported. InputError where one of these cannot be used."""
    for entry in pkgutil.iter_modules(methods.__path__):
        importlib.import_module(f"{methods.__name__}.{entry.name}")
    kinds = [kind for kind in _made_after(SearchMethod) if not inspect.isabstract(kind)]
    by_name = {kind.name: kind for kind in kinds if _of_package(kind)}
    by_name = dict(sorted(by_name.items()))
    for kind in kinds:
        # A class that is no longer to be found in its module is of a file that has been loaded anew.
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
    """Return a method by name; InputError naming the known ones when there is none."""
    by_name = every()
    rule = f"one of {', '.join(by_name)}, or your own (--plugin, import)"
    must(isinstance(name, str) and name in by_name, "method", rule, name)
    return by_name[name]


def code_of(name: str) -> str:
    """Return a checksum of the code of a method of the user; "" for one of this package, which has a
    version."""
    kind = find(name)
    return "" if _of_package(kind) else checksum_of(kind, f"method {name}")


def _of_package(kind: type) -> bool:
    return kind.__module__.startswith(f"{methods.__name__}.")


def _made_after(kind: type[Any]) -> Iterator[type[Any]]:
    for sub in kind.__subclasses__():
        yield sub
        yield from _made_after(sub)
