"""Calls of the functions that a user gives to a problem, with checks of their values and their files."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Mapping
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tisim.errors import InputError, Words, abbreviated, must, printable
from tisim.optimize.problem.constraint import InequalityConstraint
from tisim.optimize.problem.faults import FaultyProblem, error_told, function_name
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.outside import Outside, noticed
from tisim.optimize.problem.problem import Problem

if TYPE_CHECKING:
    from tisim import Scene


def make_scene(problem: Problem, design: Mapping[str, float], seed: int) -> Scene:
    """Return the scene of a design.

    InputError if its function refuses the design or the design violates a constraint; FaultyProblem if the
    function fails.
    """
    check_design(problem, design)
    rule = f"scene of problem {problem.name} must return a Scene, or raise InputError to refuse a design"
    try:
        scene = problem.scene(design, seed)
    except InputError:
        raise
    except Exception as error:
        raise FaultyProblem(f"{rule}; received {error_told(error)}") from error
    if not callable(getattr(scene, "digest", None)):
        raise FaultyProblem(f"{rule}; received {abbreviated(scene)}")
    return scene


def check_design(problem: Problem, design: Mapping[str, Any]) -> None:
    """Raise InputError if a design violates a design constraint; FaultyProblem if a constraint function
    fails."""
    for constraint in problem.design_constraints:
        value = constraint_value(constraint, design, problem)
        must(constraint.violation(value) == 0, constraint.name, constraint.rule,
             Words(f"{value:.10g} {constraint.unit}".rstrip()))  # fmt: skip


def values_of(objective: Objective, result: Any, problem: Problem) -> dict[str, float]:
    """Return the values of an objective's quantities by name.

    FaultyProblem unless each is a real number (NaN and infinity included) and only files listed in
    ``Problem.files`` were read.
    """
    what = f"objective {objective.name}"
    names = objective.statistic.quantities
    if not names:
        return {objective.name: _number(what, _called(what, "a number", objective.of, result, problem))}
    rule = f"a dictionary of {', '.join(names)}"
    found = _called(what, rule, objective.of, result, problem)
    if not isinstance(found, Mapping) or not all(name in found for name in names):
        raise FaultyProblem(f"{what} must return {rule}; received {abbreviated(found)}")
    return {name: _number(f"{what}, of {name},", found[name]) for name in names}


def constraint_value(constraint: InequalityConstraint, of: Any, problem: Problem) -> float:
    """Return the value of a constraint on a result or on a design, with the checks of ``values_of``."""
    what = f"constraint {constraint.name}"
    return _number(what, _called(what, "a number", constraint.of, of, problem))


def check_reads(what: str, read: Outside, problem: Problem) -> None:
    """Raise FaultyProblem if a function has read anything else than the files of the problem."""
    known = {Path(file).resolve() for file in problem.files}
    if unknown := sorted(map(str, read.files - known)):
        raise FaultyProblem(
            f"{what} must read no file but those in Problem(files=[...]), as its values "
            f"are used again while these are the same; received {printable(unknown[0])}"
        )
    if read.sources and not (problem.files or problem.code):
        raise FaultyProblem(
            f"{what} must start no program and open no connection, as its values are used again; "
            f"received {printable(read.sources[0])}. Or list the files that it reads in "
            "Problem(files=[...]), or give Problem(code=...), a text that you change with its answers"
        )


def check_refusal(result: Any, problem: Problem) -> None:
    """Check what a plain function has read before it refused a design. The objectives, which check this too,
    are not called for a refused design."""
    if problem.function is not None and isinstance(read := getattr(result, "read", None), Outside):
        check_reads(f"function {function_name(problem.function.of)}", read, problem)


def _called(what: str, wanted: str, of: Callable[[Any], Any], argument: Any, problem: Problem) -> Any:
    """Return the value of a function of the problem for a result or a design."""
    rule = f"{what} must return {wanted}"
    try:
        with noticed() as read:
            value: Any = of(argument)
    except FaultyProblem:
        raise
    except Exception as error:
        raise FaultyProblem(f"{rule}; received {error_told(error)}") from error
    check_reads(what, read, problem)
    if isinstance(earlier := getattr(argument, "read", None), Outside):
        check_reads(what, earlier, problem)  # by a plain function, when it was called
    return value


def _number(what: str, value: Any) -> float:
    """Return a value of a user's function as a 64-bit float."""
    rule = f"{what} must return a number"
    if isinstance(value, np.ndarray) and value.shape == () and not np.ma.is_masked(value):
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real | Decimal):
        raise FaultyProblem(f"{rule}; received {abbreviated(value)}")
    try:
        return float(value)
    except OverflowError:
        raise FaultyProblem(f"{rule} of 64 bits; received {abbreviated(value)}") from None
