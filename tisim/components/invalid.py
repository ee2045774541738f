"""What is wrong with plain data, for people: pydantic's report with the names, texts and units of a part."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from tisim.errors import InputError, abbreviated, printable


def unit_of(info: FieldInfo) -> str:
    """Return the unit that ``parameter`` declares, or an empty string."""
    extra = info.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def text_of(info: FieldInfo) -> str:
    """Return what a parameter or option is, as declared, or an empty string."""
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
"""A message lists this many faults, a line for each."""
_CHOICE = re.compile(r"int|float|tuple\[.*\]")
"""Pydantic adds this to the place of a fault, for each type that would have done."""


def explain_invalid(invalid: ValidationError, where: str, fields: Mapping[str, FieldInfo]) -> str:
    """Return one line per fault of a pydantic report, "X must be Y; received Z". ``fields``: those of the
    part."""
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
        rule = _RULES[fault["type"]].format(**context) if fault["type"] in _RULES else ""
        rule = rule or fault["msg"].removeprefix("Input should be ")
        if len(loc) == 1 and fault["type"] == "missing":
            rule += _meaning(fields[str(loc[0])])
        elif len(loc) == 1 and fault["type"] == "extra_forbidden":
            rule = f"{rule}: {' or '.join(', '.join(fields).rsplit(', ', 1)) or 'there is none'}"
        lines.setdefault(name, []).append(rule)
        received.setdefault(name, "nothing" if fault["type"] == "missing" else abbreviated(fault["input"]))
    text = [
        f"{name} must be {' or '.join(dict.fromkeys(rules))}; received {received[name]}" if rules else name
        for name, rules in lines.items()
    ]
    rest = f" (and {len(text) - FAULTS} faults more)" if len(text) > FAULTS else ""
    return "\n".join(text[:FAULTS]) + rest


def _meaning(info: FieldInfo) -> str:
    """Return what a parameter is, and its unit; in brackets."""
    what = ", ".join(filter(None, (text_of(info), unit_of(info))))
    return f" ({what})" if what else ""


def _is_choice(part: int | str) -> bool:
    return isinstance(part, str) and _CHOICE.fullmatch(part) is not None


def _named_within(name: str, loc: tuple[int | str, ...], text: str) -> list[str]:
    """Return what a part says of itself; one of several, in a list or by name, which of them it is."""
    if len(loc) < 2:
        return text.splitlines()
    lines = (line.partition(" must ") for line in text.splitlines())
    # What is no property of the row by itself, such as the mass that follows from two, has no name before it.
    return [
        f"{name}{'.' + what.partition('.')[2] if '.' in what else ', ' + what} must {rest}"
        for what, _, rest in lines
    ]
