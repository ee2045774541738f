"""Operators of deap.tools by name, or functions of the user, and the toolbox that breeds with them."""

from __future__ import annotations

import functools
import inspect
import random
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from deap import base, tools
from pydantic import Field, model_validator

from tisim import InputError
from tisim.components.component import Checked
from tisim.errors import Words, must
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.faults import function_name
from tisim.optimize.problem.problem import checksum_of
from tisim.optimize.surrogate.gaussian_process import Array

_PREFIXES = {"select": "sel", "mate": "cx", "mutate": "mut"}
"""The operators of a genetic algorithm, and the prefixes of their names in deap.tools."""
_ARITY = {"select": 2, "mate": 2, "mutate": 1}
"""Number of positional arguments in DEAP's calls of each operator."""
_LARGEST = dict.fromkeys(("selRoulette", "selStochasticUniversalSampling"), "favours large fitness values")
_FRONT = dict.fromkeys(
    ("selNSGA2", "selNSGA3", "selNSGA3WithMemory", "selSPEA2", "selTournamentDCD"),
    "is for several objectives",
)
_SEVERAL = (
    "selTournamentDCD", "selRandom", "selLexicase", "selEpsilonLexicase", "selAutomaticEpsilonLexicase",
)  # fmt: skip
"""Selections that use all objectives; others rank by the first, or omit no individual."""


class GeneticOperator(Checked):
    """An operator of deap.tools by name, or a user's function with the same signature.

    options : keyword arguments. The bounds ``low`` and ``up`` of the unit cube are added if the operator has
        such arguments and they are not given.
    checksum : checksum of a user's function and of everything that it uses; it represents the function in the
        stored settings of a search.
    """

    name: str
    options: dict[str, Any] = Field(default_factory=dict)
    checksum: str = ""
    function: Callable[..., Any] | None = Field(None, exclude=True, repr=False)

    @model_validator(mode="before")
    @classmethod
    def _called(cls, given: Any) -> Any:
        """Return the settings that a bare function or name stands for."""
        if isinstance(given, str):
            return {"name": given}
        if callable(given):
            name = function_name(given)
            return {"name": name, "function": given, "checksum": checksum_of(given, f"operator {name}")}
        return given

    def bound(self, role: str, objectives: int) -> tuple[Callable[..., Any], dict[str, Any]]:
        """Return the function for a role, ``select``, ``mate`` or ``mutate``, and its keyword arguments.

        InputError unless name and arguments are valid.
        """
        function = self.function or self._of_deap(role, objectives)
        name = getattr(_innermost(function), "__name__", "")
        if getattr(tools, name, None) is _innermost(function):
            _check_name(name, role, objectives)
        free = _parameters(function)[_ARITY[role] :]
        given = set(self.options)
        names = [parameter.name for parameter in free]
        must(given <= set(names), f"options of {self.name}", f"among {names}", sorted(given))
        open_ = [parameter.name for parameter in free if parameter.default is inspect.Parameter.empty]
        bounds = {name: value for name, value in (("low", 0.0), ("up", 1.0)) if name in open_}
        required = [name for name in open_ if name not in bounds]
        must(set(required) <= given, f"options of {self.name}", f"complete: {required}", sorted(given))
        return function, bounds | self.options

    def _of_deap(self, role: str, objectives: int) -> Callable[..., Any]:
        must(not self.checksum, role, "the function itself, from Python", Words(f"{self.name}, its name"))
        _check_name(self.name, role, objectives)
        function: Callable[..., Any] = getattr(tools, self.name)
        return function


def registered(toolbox: Any) -> dict[str, Callable[..., Any]]:
    """Return the operators that a toolbox of DEAP has, by role. InputError if it has none."""
    what = "search.options.toolbox"
    rule = f"a deap.base.Toolbox with one or more of {', '.join(_PREFIXES)}"
    must(isinstance(toolbox, base.Toolbox), what, rule, toolbox)
    found = {role: getattr(toolbox, role) for role in _PREFIXES if hasattr(toolbox, role)}
    must(bool(found), what, rule, Words(f"one with {', '.join(vars(toolbox))}"))
    return found


def _check_name(name: str, role: str, objectives: int) -> None:
    """Raise InputError unless deap.tools has an operator of this name that is fit for the role."""
    unfit = _LARGEST | _FRONT if objectives == 1 else {}
    names = [one for one in dir(tools) if one.startswith(_PREFIXES[role]) and one not in unfit]
    if role == "select" and objectives > 1:
        names = list(_SEVERAL)
    why = f" ({name} {unfit[name]})" if name in unfit else ""
    must(name in names, "operator name", f"one of {', '.join(names)}{why}", name)


def _innermost(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function that a toolbox has registered or decorated."""
    while isinstance(function, functools.partial) or hasattr(function, "__wrapped__"):
        function = function.func if isinstance(function, functools.partial) else function.__wrapped__
    return function


def _parameters(function: Callable[..., Any]) -> list[inspect.Parameter]:
    """Return the parameters that can be given by name; none for a C function without a signature."""
    if isinstance(function, functools.partial):
        # A toolbox copies ``__wrapped__`` of a decorated function, whose signature lacks the given arguments.
        function = functools.partial(function.func, *function.args, **function.keywords)
    try:
        parameters = inspect.signature(function).parameters.values()
    except ValueError:
        return []
    variable = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return [parameter for parameter in parameters if parameter.kind not in variable]


class Operators:
    """A DEAP toolbox with select, mate and mutate, and its own random numbers.

    crossover, mutation : probabilities that a pair is mated, and that an individual is then mutated.
    Raises InputError, before any run, if the operators do not support individuals of this number of real
    genes.
    """

    def __init__(
        self,
        operators: Mapping[str, GeneticOperator],
        genes: int,
        objectives: int,
        probabilities: tuple[float, float],
        seed: int,
    ) -> None:
        self.genes, self.objectives = genes, objectives
        self.crossover, self.mutation = probabilities
        self.random = OwnRandom(seed)
        self.toolbox = base.Toolbox()
        for role, operator in operators.items():
            function, options = operator.bound(role, objectives)
            self.toolbox.register(role, function, **options)
        self._rehearse({role: operator.name for role, operator in operators.items()})

    def bred(self, parents: Sequence[Individual], count: int) -> Array:
        """Return the offspring of parents of known fitness, (count, genes), in the unit cube."""
        with self.random:
            selected = self._selected(list(parents), count + count % 2)
            children = [Individual(individual, self.objectives) for individual in selected]
            for i in range(0, count, 2):
                if random.random() < self.crossover:
                    children[i : i + 2] = self.toolbox.mate(children[i], children[i + 1])
            for i, child in enumerate(children):
                if random.random() < self.mutation:
                    (children[i],) = self.toolbox.mutate(child)
        return np.clip(np.array(children[:count], dtype=float), 0.0, 1.0)

    def _selected(self, parents: list[Individual], count: int) -> list[Individual]:
        """Return ``count`` selected parents, with repetition if there are fewer."""
        tournament = _innermost(self.toolbox.select) is tools.selTournamentDCD
        if tournament and len(parents) < 4:
            parents = parents * (4 // len(parents) + 1)
        chosen: list[Individual] = []
        while len(chosen) < count:
            if tournament:  # It selects a multiple of four, each parent at most twice.
                fours = len(parents) // 4 * 4
                more = self.toolbox.select(random.sample(parents, fours), fours)
            else:  # Some operators return each parent at most once.
                more = self.toolbox.select(parents, count - len(chosen))
            must(len(more) > 0, "select", "a function that returns individuals", more)
            chosen += more
        return chosen[:count]

    def _rehearse(self, names: Mapping[str, str]) -> None:
        """Test the operators: breed from dummy individuals, one of them failed, twice with the same random
        numbers."""
        state = self.random.state
        try:
            once = self._trial()
            self.random.state = state
            again = self._trial()
        except Exception as error:
            raise InputError(
                f"operators must be fit for real-valued individuals; received {dict(names)} ({error!r})"
            ) from error
        finally:
            self.random.state = state
        good = all(len(individual) == self.genes and np.all(np.isfinite(individual)) for individual in once)
        must(good, "operators", "fit for real-valued individuals", dict(names))
        must(once == again, "operators", "random by the modules random and numpy.random alone", dict(names))

    def _trial(self) -> list[list[float]]:
        rng = np.random.default_rng(0)
        individuals = [Individual(rng.random(self.genes), self.objectives) for _ in range(8)]
        for rank, individual in enumerate(individuals):
            cost = float(rank) if rank else float("inf")
            individual.fitness.values = (cost,) * self.objectives
            individual.fitness.crowding_dist = cost
        trial = self.bred(individuals, 12).tolist()
        with self.random:
            for individual in individuals:
                trial += self.toolbox.mate(Individual(individual), Individual(individuals[0]))
                trial += self.toolbox.mutate(Individual(individual))
        return [list(individual) for individual in trial]


class OwnRandom:
    """Within ``with``, the modules random and numpy.random have this object's states; afterwards the
    caller's.

    DEAP uses random; operators of the user may use numpy.random.
    """

    def __init__(self, seed: int) -> None:
        legacy = np.random.RandomState(seed % 2**32)
        self.state = random.Random(seed).getstate(), legacy.get_state()

    def __enter__(self) -> None:
        self._callers = random.getstate(), np.random.get_state()  # noqa: NPY002
        self._set(self.state)

    def __exit__(self, *error: object) -> None:
        self.state = random.getstate(), np.random.get_state()  # noqa: NPY002
        self._set(self._callers)

    @staticmethod
    def _set(state: tuple[object, object]) -> None:
        random.setstate(state[0])  # type: ignore[arg-type]
        np.random.set_state(state[1])  # type: ignore[arg-type]  # noqa: NPY002
