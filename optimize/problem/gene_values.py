"""Names of genes, and the values that they may have in a design: numbers, texts and flags."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np

from tisim.errors import is_number, must

Value = float | int | str | bool
"""The value of a gene in a design."""
WHOLE_WITHIN = 2**50
"""The largest magnitude of an integer gene; beyond it, the centre and ends of a cell are not distinct."""
LONGEST_CHOICE = 40
"""Longest text of a choice, in characters, so that it fits the tables of a terminal."""


class Named:
    """Base class of all genes."""

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
    """Return a value of a design as a plain Python object; InputError if it is not allowed."""
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
    must(able, what, "finite, and within +-2^50 if it is whole", value)
    return int(value) if whole else float(value)


def brief(value: Value) -> str:
    """Return a value of a design with four digits; texts, flags and integers unchanged."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
