"""Arrays in validated plain data: validated like lists of numbers, and read-only."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, GetPydanticSchema
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from tisim.components.component import Vector
from tisim.components.plain_numbers import broken_rule, holds_no_number


def frozen(values: Any, kind: type | None = None) -> np.ndarray:
    """Return a read-only copy."""
    array = np.array(values, dtype=kind)
    array.flags.writeable = False
    return array


def equal(a: Any, b: Any) -> bool:
    """Return whether two values are equal: numbers, arrays, or tables and lists of them. An array may equal a
    list."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(equal(value, b[key]) for key, value in a.items())
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    return bool(a == b)


def _schema(listed: Any, columns: tuple[int, ...]) -> GetPydanticSchema:
    """Return the schema of an array with any number of rows; it accepts arrays and everything that ``listed``
    accepts."""

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
            # Convert to a list, which then reports the fault or parses the values.
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
"""An array of shape (n, 3) with at least one row."""
RowsOrNone = Annotated[np.ndarray, _schema(tuple[Vector, ...], (3,))]
"""An array of shape (n, 3) with any number of rows."""
Numbers = Annotated[np.ndarray, _schema(tuple[float, ...], ())]
"""An array of shape (n,); a single number becomes an array of one."""
