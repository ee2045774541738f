"""The table of packings of studies: one line for each packing."""

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from typing import Any, Literal, get_args

import numpy as np

from tisim.analysis import Mean
from tisim.cases.common.csv_tables import csv_text

Study = Literal[
    "aspect ratio",
    "long rods",
    "longest rods",
    "cylinder",
    "wedge",
    "superballs",
    "moment of inertia",
    "effort",
    "wedge effort",
]
STUDIES: tuple[Study, ...] = get_args(Study)


@dataclass(frozen=True)
class PackedRow:
    """A packing of a study: a line of its table, which begins with what is known before it is packed.

    Lengths are in D; an angle is in degrees; NaN where it does not apply. step : first step of the volume, in
    volumes of a body. limit : attempts for a contraction. attempts : of the whole run.
    """

    study: str
    method: str
    shape: float
    width: float
    angle: float
    inertia: float
    number: int
    step: float
    limit: int
    halvings: int
    tolerance: float
    seed: int
    attempts: int
    fraction: float
    contacts: float
    touching: float
    held: float
    nematic: float
    cubatic: float
    aligned: float

    def key(self) -> tuple[str, ...]:
        """Return the columns that identify the packing."""
        return key_of({name: getattr(self, name) for name in IDENTITY})

    def place(self) -> tuple[Any, ...]:
        """Return the place of the packing among those of its study, by which they are sorted."""
        # NaN has no place.
        numbers = np.nan_to_num([self.shape, self.angle, self.width, self.inertia, self.limit, self.seed])
        return (self.method, *numbers.tolist())


IDENTITY = tuple(one.name for one in fields(PackedRow)[:12])
"""Columns that are known before a packing is made."""


def key_of(known: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the columns that identify a packing as text."""
    values = [known[name] for name in IDENTITY]
    return tuple(f"{one:.12g}" if isinstance(one, float | int) else one for one in values)


def table(rows: Iterable[PackedRow]) -> str:
    """Return rows as CSV."""
    return csv_text([[one.name for one in fields(PackedRow)], *(astuple(one) for one in rows)])


def read(text: str) -> list[PackedRow]:
    """Return the rows of a table."""
    types: Mapping[str, Callable[[str], Any]] = {"str": str, "float": float, "int": int}
    kinds = [types[getattr(one.type, "__name__", str(one.type))] for one in fields(PackedRow)]
    lines = list(csv.reader(io.StringIO(text)))[1:]
    return [PackedRow(*(kind(cell) for kind, cell in zip(kinds, line, strict=True))) for line in lines]


def means(rows: Sequence[PackedRow], by: Sequence[str], name: str) -> dict[tuple[Any, ...], Mean]:
    """Return the mean of a measure over seeds, by the values of columns."""
    groups: dict[tuple[Any, ...], list[float]] = {}
    for one in rows:
        groups.setdefault(tuple(getattr(one, key) for key in by), []).append(getattr(one, name))
    return {key: Mean.of(values) for key, values in groups.items()}
