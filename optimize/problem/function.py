"""A plain function of a design in the place of a scene: what it gives is judged, and nothing is simulated.

A problem makes of each design a ``FunctionCall``, as others make a scene, and running it gives a
``FunctionResult``, of which objectives and constraints read their values.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from tisim.optimize.problem.calls import FaultyProblem, call_function

from tisim.engine.result import Status
from tisim.errors import InputError, abbreviated, must


@dataclass(frozen=True)
class PlainFunction:
    """Makes of a design the call of a function, in the place of ``Problem.scene``.

    of : f(design) or f(design, seed) -> a number, several, or a dictionary of them by name. It takes a seed
    where its second parameter must be given, or is named seed; else its value is one of the design alone, and
    one call of each design is enough. It may raise InputError for a design that cannot be.
    """

    of: Callable[..., Any]

    def __post_init__(self) -> None:
        must(callable(self.of), "function", "one of the design", self.of)

    @cached_property
    def takes_seed(self) -> bool:
        """Whether its values have noise."""
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
    """A call of a function that is to be made: of a design, from the seed of a random start if it has one."""

    of: Callable[..., Any]
    design: Mapping[str, Any]
    seed: int | None

    def digest(self) -> str:
        """Return a checksum of its arguments; that of the function is in ``Problem.objective_identity``."""
        arguments = json.dumps(["function", dict(self.design), self.seed], sort_keys=True)
        return hashlib.sha256(arguments.encode()).hexdigest()

    def structure(self) -> str:
        """Return what calls that go side by side have in common."""
        return "function"

    def run(self) -> FunctionResult:
        """Call it. A design that it refuses is a failed result; FaultyProblem where it is at fault."""
        begun = time.perf_counter()
        arguments = (dict(self.design),) if self.seed is None else (dict(self.design), self.seed)
        try:
            value, read = call_function(self.of, *arguments)
        except FaultyProblem:
            raise
        except InputError as error:
            status = Status(False, f"infeasible: {error}")
            return FunctionResult(self.design, None, status, time.perf_counter() - begun)
        return FunctionResult(self.design, value, Status(True, ""), time.perf_counter() - begun, read)


@dataclass(frozen=True)
class FunctionResult:
    """What a plain function has given.

    value : as it was returned. status, wall_s, work : as of ``tisim.Result``. files_read : files of the user.
    """

    design: Mapping[str, Any]
    value: Any
    status: Status
    wall_s: float
    files_read: frozenset[Path] = frozenset()
    work: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class ValueOf:
    """Reads a value of a function's result: by name of a dictionary, else by its place among so many.

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
