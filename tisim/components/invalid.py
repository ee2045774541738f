"""Error messages for invalid plain data: pydantic's report with the names, texts and units of a part."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from tisim.errors import InputError, abbreviated, did_you_mean, printable


def unit_of(info: FieldInfo) -> str:
    """Return the unit that ``parameter`` declares, or an empty string."""
    extra = info.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def text_of(info: FieldInfo) -> str:
    """Return the declared text of a parameter or option, or an empty string."""
    return info.description or ""


_RULES = {
    "greater_than": "greater than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number",
    "float_parsing": "a number",
    "float_type": "a number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number that is not so large",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "string_type": "text",
    "string_pattern_mismatch": "text of the form {pattern}",
    "missing": "given",
    "extra_forbidden": "a known key",
    "literal_error": "{expected}",
    "tuple_type": "a list",
    "too_short": "a list of {min_length}",
    "too_long": "a list of {max_length}",
}


FAULTS = 10
"""Largest number of faults listed in a message, one per line."""
_CHOICE = re.compile(r"int|float|tuple\[.*\]")
"""Pydantic appends this to the location of a fault, for each accepted type."""


def explain_invalid(invalid: ValidationError, where: str, fields: Mapping[str, FieldInfo]) -> str:
    """Return one line per fault of a pydantic report, "X must be Y; received Z". ``fields``: the fields of
    the part."""
    lines: dict[str, list[str]] = {}
    received: dict[str, str] = {}
    for fault in invalid.errors(include_url=False):
        loc = tuple(itertools.takewhile(lambda part: not _is_choice(part), fault["loc"]))
        name = printable(".".join([where, *map(str, loc)]))
        context: Mapping[str, Any] = fault.get("ctx", {})
        if isinstance(context.get("error"), InputError):
            for line in _named_within(name, loc, str(context["error"])):
                lines.setdefault(line, [])
            continue
        nearest = ""
        rule = _RULES[fault["type"]].format(**context) if fault["type"] in _RULES else ""
        rule = rule or fault["msg"].removeprefix("Input should be ")
        if len(loc) == 1 and fault["type"] == "missing":
            rule += _meaning(fields[str(loc[0])])
        elif len(loc) == 1 and fault["type"] == "extra_forbidden":
            rule = f"{rule}: {' or '.join(', '.join(fields).rsplit(', ', 1)) or 'there is none'}"
            nearest = did_you_mean(str(loc[0]), fields)
        lines.setdefault(name, []).append(rule)
        value = "nothing" if fault["type"] == "missing" else abbreviated(fault["input"])
        received.setdefault(name, f"{value}{nearest}")
    text = [
        f"{name} must be {' or '.join(dict.fromkeys(rules))}; received {received[name]}" if rules else name
        for name, rules in lines.items()
    ]
    rest = f" (and {len(text) - FAULTS} faults more)" if len(text) > FAULTS else ""
    return "\n".join(text[:FAULTS]) + rest


def _meaning(info: FieldInfo) -> str:
    """Return the text and the unit of a parameter, in brackets."""
    what = ", ".join(filter(None, (text_of(info), unit_of(info))))
    return f" ({what})" if what else ""


def _is_choice(part: int | str) -> bool:
    return isinstance(part, str) and _CHOICE.fullmatch(part) is not None


def _named_within(name: str, loc: tuple[int | str, ...], text: str) -> list[str]:
    """Return the messages of a part itself. For a part in a list or table, the messages also name the row."""
    if len(loc) < 2:
        return text.splitlines()
    lines = (line.partition(" must ") for line in text.splitlines())
    # A message about several properties together, such as a mass derived from two of them, has no property
    # name before it.
    return [
        f"{name}{'.' + what.partition('.')[2] if '.' in what else ', ' + what} must {rest}"
        for what, _, rest in lines
    ]
