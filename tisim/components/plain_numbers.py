"""Numbers and arrays as users give them, of NumPy too: each is the same number in plain data, or is refused.

Pydantic takes True for 1, drops the imaginary part of a complex number of NumPy, reads values under a mask
and takes large whole numbers of NumPy through a float.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
from pydantic import Field, GetPydanticSchema
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from tisim.components.component import Vector
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


def frozen(values: Any, kind: type | None = None) -> np.ndarray:
    """Return a copy that is not writeable."""
    array = np.array(values, dtype=kind)
    array.flags.writeable = False
    return array


def equal(a: Any, b: Any) -> bool:
    """Return whether two values are the same: numbers, tables or lists of them, or arrays, also beside
    lists."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(equal(value, b[key]) for key, value in a.items())
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    return bool(a == b)


def _schema(listed: Any, columns: tuple[int, ...]) -> GetPydanticSchema:
    """Return an array of as many rows as are given, from such an array or from what makes the list."""

    def validated(value: Any, as_list: Callable[[Any], Any]) -> np.ndarray:
        if rule := broken_rule(value):
            raise PydanticCustomError("numbers", rule)
        if isinstance(value, np.ndarray):
            if value.dtype.kind in "iuf" and value.shape[1:] == columns and value.ndim and len(value):
                array = frozen(value, float)
                if np.isfinite(array).all():
                    return array
        elif holds_no_number(value):
            raise PydanticCustomError("numbers", "numbers")
        if isinstance(value, np.ndarray | np.generic):
            # What is wrong with it, or how it can be read, is found out as of a list.
            value = value.tolist()
        array = np.array(as_list((value,) if isinstance(value, float | int) else value), float)
        return frozen(array.reshape(-1, *columns))

    def serialized(array: np.ndarray, info: Any) -> Any:
        return array.tolist() if info.mode_is_json() else array

    def schema(source: Any, handler: Callable[[Any], CoreSchema]) -> CoreSchema:
        to_list = core_schema.plain_serializer_function_ser_schema(serialized, info_arg=True)
        return core_schema.no_info_wrap_validator_function(validated, handler(listed), serialization=to_list)

    return GetPydanticSchema(schema)


Rows = Annotated[np.ndarray, _schema(Annotated[tuple[Vector, ...], Field(min_length=1)], (3,))]
"""Rows are an array of shape (n, 3), with at least one row."""
RowsOrNone = Annotated[np.ndarray, _schema(tuple[Vector, ...], (3,))]
"""These are an array of shape (n, 3), of any number of rows."""
Numbers = Annotated[np.ndarray, _schema(tuple[float, ...], ())]
"""Numbers are an array of shape (n,); a single number is one of one."""
