"""A user's function that fails: the error, in one line with its place in the user's file."""

from __future__ import annotations

import functools
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tisim.errors import InputError, printable
from tisim.optimize.problem.outside import Outside, is_of_user, noticed


class FaultyProblem(InputError):
    """A function of a problem fails: the search ends, and its results so far are kept."""


def call_function(of: Callable[..., Any], *arguments: Any) -> tuple[Any, Outside]:
    """Return the value of a plain function of a design, or the InputError with which it refuses the design;
    and the files and programs that it used.

    FaultyProblem if it fails.
    """
    try:
        with noticed() as read:
            value = of(*arguments)
    except InputError as error:
        return error, read
    except Exception as error:
        rule = f"function {function_name(of)} must return numbers, or raise InputError to refuse a design"
        raise FaultyProblem(f"{rule}; received {error_told(error)}") from error
    return value, read


def function_name(of: Callable[..., Any]) -> str:
    """Return the name of a function, of the function in a partial, or of the class of an object."""
    while isinstance(of, functools.partial):
        of = of.func
    return getattr(of, "__name__", type(of).__name__).strip("<>")


def error_told(error: Exception) -> str:
    """Return an error in a user's function as one line, with its place in the user's file."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [one for one in frames if is_of_user(Path(one.filename))]
    place = f" ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else ""
    return printable(f"{type(error).__name__}: {' '.join(str(error).split())}") + printable(place)
