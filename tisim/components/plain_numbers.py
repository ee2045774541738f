"""Numbers as users give them, of NumPy too: each is the same number in plain data, or is refused.

Pydantic takes True for 1, drops the imaginary part of a complex number of NumPy, reads values under a mask
and takes large whole numbers of NumPy through a float.
"""

from __future__ import annotations

import types
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np

from tisim.errors import must

DEEPEST = 3
"""No list of numbers has lists in it deeper than this."""


def is_numeric(annotation: Any) -> bool:
    """Return whether a setting of this type is a number, or has fixed or any numbers of them, or may be left
    out."""
    return _leaves(annotation) <= {int, float, type(None), Ellipsis} and annotation is not type(None)


def _leaves(annotation: Any) -> set[Any]:
    """Return the types that a type is made of."""
    if get_origin(annotation) is Annotated:
        return _leaves(get_args(annotation)[0])
    if get_origin(annotation) in (tuple, list, Union, types.UnionType):
        return set().union(*map(_leaves, get_args(annotation)))
    return {annotation}


def plain(where: str, value: Any, depth: int = DEEPEST) -> Any:
    """Return a number, a list or an array of numbers with what is of NumPy as numbers and lists of Python;
    raise InputError, naming ``where``, for flags, complex numbers and what is masked. All else is as it
    was."""
    rule = broken_rule(value)
    must(not rule, where, rule, value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple) and depth > 0:
        return [plain(f"{where}.{k}", one, depth - 1) for k, one in enumerate(value)]
    return value


def holds_no_number(value: Any, depth: int = DEEPEST) -> bool:
    """Return whether a list has a flag, a complex number or what is masked in it."""
    if isinstance(value, list | tuple) and depth > 0:
        return any(holds_no_number(one, depth - 1) for one in value)
    return bool(broken_rule(value))


def broken_rule(value: Any) -> str:
    """Return what a value must be that is a flag, a complex number or masked, or an array of these; an empty
    string for all others."""
    if isinstance(value, bool | complex):
        return "a number"
    if isinstance(value, np.ndarray | np.generic):
        if np.ma.is_masked(value):
            return "without masked entries"
        if value.dtype.kind in "bc":
            return "numbers" if value.ndim else "a number"
    return ""
