"""Names of genes, and the values that they may have in a design: numbers, texts and flags."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np

from tisim.errors import is_number, must

Value = float | int | str | bool
"""What a gene may be in a design."""
WHOLE_WITHIN = 2**50
"""Whole numbers between plus and minus this have a middle of their cell that is told from its ends."""
LONGEST_CHOICE = 40
"""Texts of more characters are wider than the tables of a terminal."""


class Named:
    """What all kinds of genes have."""

    name: str
    unit: str

    @property
    def label(self) -> str:
        """The name and the unit, as a table heading."""
        return f"{self.name} ({self.unit})" if self.unit else self.name


def check_name(name: Any) -> None:
    """Raise InputError unless a gene can have this name."""
    must(isinstance(name, str) and bool(name.strip()), "gene name", "a non-empty string", name)


def plain_value(value: Any, what: str) -> Value:
    """Return a value of a design as Python has it; InputError unless it is one."""
    if isinstance(value, np.ndarray) and value.shape == ():
        value = value[()]
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, str):
        printable = value.isprintable() and len(value.strip()) > 0 and len(value) <= LONGEST_CHOICE
        must(printable, what, f"a printable text of at most {LONGEST_CHOICE} characters", value)
        return value
    if isinstance(value, bool):
        return value
    must(is_number(value), what, "a text, a number or a flag", value)
    whole = isinstance(value, numbers.Integral)
    able = abs(value) <= WHOLE_WITHIN if whole else math.isfinite(value)
    must(able, what, "finite, and within +-2^50 where it is whole", value)
    return int(value) if whole else float(value)


def brief(value: Value) -> str:
    """Return a value of a design with four digits, or as it is where it is no number with a fraction."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
