"""Genes that are searched: real numbers, integers and choices.

Each gene has one coordinate u, 0..1, of the unit cube. For an integer or a choice the interval 0..1 is
divided into cells, one for each value, and every u in a cell decodes to the value of that cell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tisim.errors import InputError, abbreviated, is_number, must
from tisim.optimize.problem.gene_values import WHOLE_WITHIN, Named, Value, check_name, plain_value

Scale = Literal["linear", "log"]
NEAR = 64
"""Number of neighbours on either side of the formula's result that are tried as the exact inverse of a
scale."""


@dataclass(frozen=True)
class Gene(Named):
    """A number that is searched.

    name : the key in a design; unit : for display, "" if there is none.
    low, high : the search range in that unit, both ends included, low < high.
    scale : "linear", or "log" for a range that spans decades (low > 0); the search is uniform on this scale.
    integer : whether only integers are allowed. On the linear scale all integers have equal parts of 0..1; on
        the log scale k has the part between k - 1/2 and k + 1/2.
    Raises InputError for an empty name, a range that is not finite and increasing, or an unknown scale.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: Scale = "linear"
    integer: bool = False

    def __post_init__(self) -> None:
        check_name(self.name)
        for which in ("low", "high"):
            value = getattr(self, which)
            must(is_number(value), f"{which} of gene {self.name}", "a number", value)
            if self.integer:
                whole = float(value).is_integer() and abs(value) <= WHOLE_WITHIN
                must(whole, f"{which} of integer gene {self.name}", "a whole number within +-2^50", value)
            # A range of 200 overflows an 8-bit NumPy integer.
            object.__setattr__(self, which, int(value) if self.integer else float(value))
        finite = math.isfinite(self.low) and math.isfinite(self.high)
        must(
            finite and self.low < self.high,
            f"range of gene {self.name}",
            "finite with low < high",
            (self.low, self.high),
        )
        must(self.scale in ("linear", "log"), f"scale of gene {self.name}", "'linear' or 'log'", self.scale)
        must(
            self.scale == "linear" or self.low > 0, f"low of gene {self.name} on a log scale", "> 0", self.low
        )

    @property
    def kind(self) -> str:
        """ "real" or "integer"."""
        return "integer" if self.integer else "real"

    @property
    def width(self) -> int:
        """The number of its columns in ``Genome.features``."""
        return 1

    @property
    def described(self) -> str:
        """A text of all properties that define the gene; part of the identity of a search."""
        words = f"{self.low!r} to {self.high!r} {self.unit}".rstrip() + f", {self.scale}"
        return f"{words}, whole" if self.integer else words

    def decode(self, u: float) -> float | int:
        """Return the physical value at u in 0..1; exactly low at 0 and high at 1."""
        if self.integer:
            return int(self.low) + int(self._places(np.array([u]))[0])
        if self.scale == "log":
            value = self.low * (self.high / self.low) ** u
        else:
            value = self.low + u * (self.high - self.low)
        return float(min(max(value, self.low), self.high))

    def encode(self, value: Any) -> float:
        """Return a u that decodes to the value, to the last bit if the value was itself decoded.

        InputError outside the range.
        """
        within = is_number(value) and self.low <= value <= self.high
        within = within and (not self.integer or float(value).is_integer())
        kind = "a whole number" if self.integer else "a number"
        rule = f"{kind} within {self.low:.10g}..{self.high:.10g} {self.unit}".rstrip()
        must(within, f"gene {self.name}", rule, value)
        if self.integer:
            return float(self._middles(np.array([int(value) - self.low], float))[0])
        number = float(value)
        if self.scale == "log":
            u = math.log(number / self.low) / math.log(self.high / self.low)
        else:
            u = (number - self.low) / (self.high - self.low)
        return min(_neighbours(u), key=lambda near: abs(self.decode(near) - number))

    def snap(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return for each u the canonical u of its value: the centre of its cell, or u itself for a real
        number."""
        return self._middles(self._places(u)) if self.integer else u

    def features(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the feature columns of the values at u, shape (points, 1), for a surrogate."""
        return self.snap(u)[:, None]

    def parse(self, text: str) -> float | int:
        """Return the value in a cell of a table; InputError if it is not a number."""
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        must(math.isfinite(number), f"gene {self.name}", "a number", text)
        return int(number) if self.integer and number.is_integer() else number

    def _places(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the index, from 0, of the integer at each u."""
        last = self.high - self.low
        if self.scale == "linear":
            return np.clip(np.floor(u * (last + 1)), 0, last)
        bottom, span = self._log_ends()
        return np.clip(np.floor(np.exp(bottom + u * span) + 0.5) - self.low, 0, last)

    def _middles(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the cell centres of the integers with these indices."""
        if self.scale == "linear":
            return (places + 0.5) / (self.high - self.low + 1)
        bottom, span = self._log_ends()
        k = places + self.low
        return (0.5 * (np.log(k - 0.5) + np.log(k + 0.5)) - bottom) / span

    def _log_ends(self) -> tuple[float, float]:
        """Return the lower end and the length of the log scale of integers."""
        bottom = math.log(self.low - 0.5)
        return bottom, math.log(self.high + 0.5) - bottom


@dataclass(frozen=True)
class Choice(Named):
    """One of several texts, numbers or flags, each with an equal part of 0..1.

    choices : at least two, all different: texts, numbers, flags, or a mixture that contains texts.
    ordered : whether neighbours in the list are similar, as in (32, 64, 128); otherwise all choices are
        equally far from each other.
    """

    name: str
    choices: Sequence[Value]
    unit: str = ""
    ordered: bool = False

    def __post_init__(self) -> None:
        check_name(self.name)
        listed = isinstance(self.choices, Sequence) and not isinstance(self.choices, str)
        must(listed, f"choices of {self.name}", "a list of texts, numbers or flags", self.choices)
        values = tuple(plain_value(value, f"choice of {self.name}") for value in self.choices)
        must(len(values) > 1, f"choices of {self.name}", "two or more", list(values))
        # 1 equals True, and a table has one type a column.
        must(len(set(map(str, values))) == len(set(values)) == len(values), f"choices of {self.name}",
             "all different, also as texts", list(values))  # fmt: skip
        flags = {isinstance(value, bool) for value in values if not isinstance(value, str)}
        must(len(flags) < 2, f"choices of {self.name}", "without flags among numbers", list(values))
        object.__setattr__(self, "choices", values)

    @property
    def kind(self) -> str:
        """ "ordered" or "category"."""
        return "ordered" if self.ordered else "category"

    @property
    def width(self) -> int:
        """The number of its columns in ``Genome.features``."""
        return 1 if self.ordered else len(self.choices)

    @property
    def described(self) -> str:
        """A text of all properties that define the gene; part of the identity of a search."""
        return (
            f"one of {', '.join(map(repr, self.choices))} {self.unit}".rstrip() + ", ordered" * self.ordered
        )

    def decode(self, u: float) -> Value:
        """Return the choice whose part of 0..1 contains u."""
        return self.choices[int(self._places(np.array([u]))[0])]

    def encode(self, value: Any) -> float:
        """Return the centre of the part of a choice; InputError for any other value."""
        value = value.item() if isinstance(value, np.generic) else value
        known = [k for k, choice in enumerate(self.choices) if _same(choice, value)]
        must(bool(known), f"gene {self.name}", f"one of {', '.join(map(repr, self.choices))}", value)
        return (known[0] + 0.5) / len(self.choices)

    def snap(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return for each u the centre of its part of 0..1."""
        return (self._places(u) + 0.5) / len(self.choices)

    def features(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the feature columns of the choices at u for a surrogate.

        An ordered gene has one column. Otherwise there is a column for each choice, scaled so that any two
        choices are at distance 1.
        """
        if self.ordered:
            return self.snap(u)[:, None]
        return (self._places(u)[:, None] == np.arange(len(self.choices))) / math.sqrt(2.0)

    def parse(self, text: str) -> Value:
        """Return the choice in a cell of a table; InputError if it is none of them."""
        for choice in self.choices:
            if text.strip() == str(choice) or (is_number(choice) and _number(text) == choice):
                return choice
        raise InputError(
            f"gene {self.name} must be one of {', '.join(map(repr, self.choices))}; "
            f"received {abbreviated(text)}"
        )

    def _places(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.clip(np.floor(u * len(self.choices)), 0, len(self.choices) - 1)


Searched = Gene | Choice


def _same(one: Value, other: Any) -> bool:
    """Return whether two values are equal; a flag does not equal a number."""
    return isinstance(one, bool) == isinstance(other, bool) and bool(one == other)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _neighbours(u: float) -> list[float]:
    """Return u in 0..1 and its neighbours, nearest first.

    They differ by steps of the last bit of u, which separate values near 0, and by steps of the last bit of
    1, the possible error of a logarithm.
    """
    steps = sorted((k * size for k in range(-NEAR, NEAR + 1) for size in (math.ulp(u), 2.0**-56)), key=abs)
    return [min(max(u + step, 0.0), 1.0) for step in steps]
