"""JSON text of plain data with arrays in it, a piece at a time: what ``json.dumps`` gives of their lists.

Of arrays of floats it takes a fraction of that time and of the memory: a start can have millions.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pydantic_core import to_json

ROWS = 1 << 14
"""Rows of an array in a piece."""
MANY = 0.3
"""Part of the numbers in a piece above which it is quicker to have Python write all."""
PLAIN = 1e-4, 1e16
"""Magnitudes that Python and pydantic write alike, without an exponent."""


def json_pieces(value: Any) -> Iterator[str]:
    """The text of ``json.dumps(value, sort_keys=True)``, where arrays stand for their lists."""
    if isinstance(value, np.ndarray):
        yield from _array(value)
    elif isinstance(value, Mapping):
        yield "{"
        for k, key in enumerate(sorted(value)):
            yield f"{', ' * (k > 0)}{json.dumps(key)}: "
            yield from json_pieces(value[key])
        yield "}"
    else:
        yield json.dumps(value, sort_keys=True)


def _array(array: np.ndarray) -> Iterator[str]:
    if array.ndim == 0 or array.dtype.kind != "f":
        yield json.dumps(array.tolist())
        return
    yield "["
    for begin in range(0, len(array), ROWS):
        yield ", " * (begin > 0) + _rows(array[begin : begin + ROWS])[1:-1]
    yield "]"


def _rows(array: np.ndarray) -> str:
    """The shortest decimals that are these numbers."""
    numbers = np.asarray(array, float)
    size = np.abs(numbers).ravel()
    other = np.flatnonzero(((size < PLAIN[0]) & (size > 0)) | (size >= PLAIN[1]))
    if len(other) > MANY * size.size:
        return json.dumps(numbers.tolist())
    words = to_json(numbers.tolist()).decode().split(",")
    for k in other:
        number = words[k].strip("[]")
        words[k] = words[k].replace(number, repr(float(number)))
    return ", ".join(words)
