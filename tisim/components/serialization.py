"""Conversion of parts of a scene to and from plain data, in which each part has the name of its kind.

JSON text of data with arrays is made in pieces. For arrays of floats this takes a fraction of the time and
memory of ``json.dumps`` on nested lists; a start can have millions of rows.
"""

from __future__ import annotations

import importlib
import json
import pkgutil
import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import zip_longest
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, get_args

import numpy as np
from pydantic_core import to_json

from tisim.components.component import Component
from tisim.errors import InputError, Words, abbreviated, must, printable

Part = TypeVar("Part", bound=Component)
HERE = Path()
"""The working directory."""


def load(package: ModuleType) -> None:
    """Import every module of a package and its subpackages, so that its parts can be found by name."""
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        importlib.import_module(module.name)


def table(data: Any, where: str, what: str = "a table") -> dict[str, Any]:
    """Return a copy of a table with text keys; raise InputError naming ``where`` for anything else."""
    must(isinstance(data, Mapping), where, what, data)
    for key in data:
        must(isinstance(key, str), f"a key of {where}", "text", key)
    return dict(data)


def from_dict(base: type[Part], data: Any, where: str, folder: Path = HERE) -> Part:
    """Return the part of the kind ``data["kind"]``; its other keys are its parameters. A string alone names a
    kind without parameters.

    folder : base folder of file names in the data; the working directory unless given.
    """
    values: dict[str, Any] = {"kind": data} if isinstance(data, str) else table(data, where)
    must("kind" in values, f"{where}.kind", f"given, to name a kind of {base.kind()}", Words("nothing"))
    kind = base.named(values.pop("kind"), f"{where}.kind")
    return kind(**_with_parts(kind, values, where, folder))


def _with_parts(kind: type[Component], values: dict[str, Any], where: str, folder: Path) -> dict[str, Any]:
    """Return the parameters of a kind, with nested tables replaced by the parts that they describe."""
    values = kind.from_files(values, where, folder)
    listed = dict(kind.lists())
    for name, info in kind.model_fields.items():
        # All rows of a list are of one kind, so they do not name it.
        inner = None if name in listed else _part(info.annotation)
        if name in values and inner is not None:
            values[name] = from_dict(inner, values[name], f"{where}.{name}", folder)
    for name in listed.keys() & values.keys():
        if isinstance(values[name], list | tuple):
            places = [f"{where}.{name}.{k}" for k in range(len(values[name]))]
            rows = zip(values[name], places, strict=True)
            values[name] = [
                _with_parts(listed[name], table(row, place), place, folder) for row, place in rows
            ]
    return values


def _part(annotation: Any) -> type[Component] | None:
    """Return the class of the part that a field holds, which may be optional."""
    kinds = [
        t for t in (get_args(annotation) or (annotation,)) if isinstance(t, type) and issubclass(t, Component)
    ]
    return kinds[0] if kinds else None


def to_dict(part: Component, named: bool = True, arrays: bool = False) -> dict[str, Any]:
    """Return kind and parameters of a part and of its nested parts, without None and empty lists.

    arrays : whether arrays are kept; otherwise they become lists.
    """
    dumped = part.model_dump(mode="python" if arrays else "json")
    values = {key: value for key, value in dumped.items() if value is not None}
    for key in values:
        if isinstance(inner := getattr(part, key), Component):
            values[key] = to_dict(inner)
    for key, _ in part.lists():
        values[key] = [to_dict(row, named=False) for row in getattr(part, key)]
        if not (values[key] or type(part).model_fields[key].is_required()):
            del values[key]
    return {"kind": part.kind(), **values} if named else values


def toml(data: Mapping[str, Any], path: str = "") -> str:
    """Return the TOML text of nested tables of numbers, text, flags and lists."""
    tables = {key for key, value in data.items() if isinstance(value, Mapping) or _tables(value)}
    lines = [f"{_key(key)} = {inline(value)}" for key, value in data.items() if key not in tables]
    text = "\n".join(lines) + "\n" if lines else ""
    for key, value in data.items():
        name = f"{path}.{_key(key)}" if path else _key(key)
        if isinstance(value, Mapping):
            text += f"\n[{name}]\n{toml(value, name).lstrip()}"
        elif key in tables:
            text += "".join(f"\n[[{name}]]\n{toml(row, name).lstrip()}" for row in value)
    return text


def _tables(value: Any) -> bool:
    """Return whether it is a list of tables."""
    return isinstance(value, list) and bool(value) and all(isinstance(row, Mapping) for row in value)


def inline(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(inline(item) for item in value) + "]"
    # TOML strings are JSON strings, but without surrogate pairs, and DEL must be escaped too.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    """Return a key of a table, in quotes unless it has only ASCII letters, digits, - and _."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else inline(name)


_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_DEEP = re.compile(rf"""(?<![\w."'-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{64}}""")
"""Pattern of a dotted key with more components than any scene has."""


def parse(text: str) -> dict[str, Any]:
    """Return the table in a TOML text; ValueError or RecursionError if it cannot be read."""
    # The time of tomllib grows as the square of the number of components of a key: minutes for some ten
    # thousand.
    if _DEEP.search(text):
        raise RecursionError("a key of too many parts")
    return tomllib.loads(text)


def read_toml(text: str, what: str, source: str) -> dict[str, Any]:
    """Return the table in a TOML text; raise InputError naming ``what`` and ``source`` if it is not TOML."""
    try:
        return parse(text)
    except RecursionError:
        raise InputError(f"{what} must be less deeply nested; received {abbreviated(source)}") from None
    except ValueError as fault:
        # Invalid TOML, or a number with more digits than Python reads.
        raise InputError(
            f"{what} must be TOML; received {abbreviated(source)} ({printable(str(fault))})"
        ) from None


ROWS_PER_PIECE = 1 << 10
"""Number of rows of an array in one piece of text."""
PLAIN = 1e-4, 1e16
"""Python and pydantic write magnitudes in this range identically, without an exponent."""


def json_pieces(value: Any) -> Iterator[str]:
    """Yield the text of ``json.dumps(value, sort_keys=True)``, with arrays written as lists."""
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
    for begin in range(0, len(array), ROWS_PER_PIECE):
        yield ", " * (begin > 0) + _rows(array[begin : begin + ROWS_PER_PIECE])[1:-1]
    yield "]"


def _rows(array: np.ndarray) -> str:
    """Return the numbers as the shortest decimals that reproduce them."""
    numbers = np.asarray(array, float)
    size = np.abs(numbers)
    other = ((size < PLAIN[0]) & (size > 0)) | (size >= PLAIN[1])
    # These are formatted by Python and inserted in place of NaN.
    digits = [repr(number) for number in numbers[other].tolist()]
    listed = np.where(other, np.nan, numbers).tolist()
    between = to_json(listed, inf_nan_mode="constants").decode().replace(",", ", ").split("NaN")
    return "".join(part for pair in zip_longest(between, digits, fillvalue="") for part in pair)
