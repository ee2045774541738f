"""A plain function of a design that replaces the simulation.

A problem turns each design into a ``FunctionCall``, in the way that others make a scene. Running it returns a
``FunctionResult``, from which objectives and constraints read their values.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from tisim.engine.result import Status
from tisim.errors import InputError, abbreviated, must
from tisim.optimize.problem.faults import FaultyProblem, call_function
from tisim.optimize.problem.outside import Outside


@dataclass(frozen=True)
class PlainFunction:
    """Turns a design into a call of a function; takes the place of ``Problem.scene``.

    of : f(design) or f(design, seed) -> one number, several, or a dictionary by name. The seed is passed if
        the second parameter is required, or is named seed; otherwise the value depends on the design alone,
        and each design is called once. It may raise InputError to refuse a design.
    """

    of: Callable[..., Any]

    def __post_init__(self) -> None:
        must(callable(self.of), "function", "one of the design", self.of)

    @cached_property
    def takes_seed(self) -> bool:
        """Whether its values depend on a seed."""
        try:
            parameters = [*inspect.signature(self.of).parameters.values()]
        except (TypeError, ValueError):
            return False
        places = [one for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
        return any(one.name == "seed" or one.default is one.empty for one in places[1:2])

    def __call__(self, design: Mapping[str, Any], seed: int) -> FunctionCall:
        return FunctionCall(self.of, dict(design), seed if self.takes_seed else None)


@dataclass(frozen=True)
class FunctionCall:
    """A call to be made: the function, a design, and the seed of a random start if the function takes one."""

    of: Callable[..., Any]
    design: Mapping[str, Any]
    seed: int | None

    def digest(self) -> str:
        """Return a checksum of its arguments; the checksum of the function is in
        ``Problem.objective_identity``."""
        arguments = json.dumps(["function", dict(self.design), self.seed], sort_keys=True)
        return hashlib.sha256(arguments.encode()).hexdigest()

    def structure(self) -> str:
        """Return the key that calls of one batch share."""
        return "function"

    def run(self) -> FunctionResult:
        """Call the function. A refused design gives a failed result; FaultyProblem if the function fails."""
        begun = time.perf_counter()
        arguments = (dict(self.design),) if self.seed is None else (dict(self.design), self.seed)
        value, read = call_function(self.of, *arguments)
        refused = isinstance(value, InputError)
        status = Status(False, f"infeasible: {value}") if refused else Status(True, "")
        wall_s = time.perf_counter() - begun
        return FunctionResult(self.design, None if refused else value, status, wall_s, read)


@dataclass(frozen=True)
class FunctionResult:
    """The result of a plain function.

    value : the returned value. status, wall_s, work : as in ``tisim.Result``. read : files and
    programs that the function used.
    """

    design: Mapping[str, Any]
    value: Any
    status: Status
    wall_s: float
    read: Outside = field(default_factory=Outside)
    work: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class ValueOf:
    """Reads a value from the result of a function: by name from a dictionary, else by its position.

    function : its name, for messages.
    """

    function: str
    names: tuple[str, ...]
    name: str

    def __call__(self, result: FunctionResult) -> Any:
        value = result.value
        if isinstance(value, Mapping):
            if self.name not in value:
                raise self._fault(f"a dictionary with {self.name!r}", value)
            return value[self.name]
        listed = isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.ndim == 1)
        if not listed and len(self.names) == 1:
            return value
        if not listed or len(value) != len(self.names):
            raise self._fault(f"{len(self.names)} values ({', '.join(self.names)})", value)
        return value[self.names.index(self.name)]

    def _fault(self, rule: str, value: Any) -> FaultyProblem:
        return FaultyProblem(f"function {self.function} must return {rule}; received {abbreviated(value)}")
