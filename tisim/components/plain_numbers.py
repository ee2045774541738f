"""Numbers from users, including NumPy's: each is converted exactly to a plain Python number, or refused.

This is done before pydantic, which takes True for 1, drops the imaginary part of NumPy's complex numbers,
reads values under a mask and converts large NumPy integers through a float.
"""

from __future__ import annotations

import types
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np

from tisim.errors import must

DEEPEST = 3
"""Deepest nesting of lists of numbers."""


def is_numeric(annotation: Any) -> bool:
    """Return whether a setting of this type is a number or a tuple of numbers, possibly optional."""
    return _leaves(annotation) <= {int, float, type(None), Ellipsis} and annotation is not type(None)


def _leaves(annotation: Any) -> set[Any]:
    """Return the set of elementary types in a type."""
    if get_origin(annotation) is Annotated:
        return _leaves(get_args(annotation)[0])
    if get_origin(annotation) in (tuple, list, Union, types.UnionType):
        return set().union(*map(_leaves, get_args(annotation)))
    return {annotation}


def plain(where: str, value: Any, depth: int = DEEPEST) -> Any:
    """Return a value with NumPy numbers and arrays converted to Python numbers and lists; other values are
    unchanged. Raise InputError, naming ``where``, for booleans, complex numbers and masked entries."""
    rule = broken_rule(value)
    must(not rule, where, rule, value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple) and depth > 0:
        return [plain(f"{where}.{k}", one, depth - 1) for k, one in enumerate(value)]
    return value


def holds_no_number(value: Any, depth: int = DEEPEST) -> bool:
    """Return whether a value or a nested list contains a boolean, a complex number or a masked entry."""
    if isinstance(value, list | tuple) and depth > 0:
        return any(holds_no_number(one, depth - 1) for one in value)
    return bool(broken_rule(value))


def broken_rule(value: Any) -> str:
    """Return the rule that a boolean, complex or masked value, or an array of these, breaks; an empty string
    for all other values."""
    if isinstance(value, bool | complex):
        return "a number"
    if isinstance(value, np.ndarray | np.generic):
        if np.ma.is_masked(value):
            return "without masked entries"
        if value.dtype.kind in "bc":
            return "numbers" if value.ndim else "a number"
    return ""
