"""The table of packings of studies: one line for each packing."""

import csv
import io
import math
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
    "inertia effort",
]
STUDIES: tuple[Study, ...] = get_args(Study)


@dataclass(frozen=True)
class PackedRow:
    """A packing of a study: a line of its table, which begins with what is known before it is packed.

    Lengths are in D; an angle is in degrees; NaN where it does not apply. step : first step of the volume, in
    volumes of a body. limit : attempts for a contraction. attempts : of the whole run. aligned, with_any :
    f_align of B16, and the part of the bodies near walls that lie along at least one.
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
    with_any: float

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

MEASURES = (*(one.name for one in fields(PackedRow)[13:]), "attempts")
"""Columns of measures, the attempts last."""


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


def summary(rows: Sequence[PackedRow]) -> list[list[str]]:
    """Return the means of all measures over seeds with their 95 % intervals, a line for each packing, below a
    line of headings. Columns that are the same in all rows, or that do not apply, are left out."""
    settings = [
        name for k, name in enumerate(IDENTITY[:-1]) if len({one.key()[k] for one in rows}) > 1
    ]  # fmt: skip
    groups: dict[tuple[str, ...], list[PackedRow]] = {}
    for one in sorted(rows, key=PackedRow.place):
        groups.setdefault(one.key()[:-1], []).append(one)
    measures = [name for name in MEASURES if any(np.isfinite(getattr(one, name)) for one in rows)]
    lines = [[*settings, "starts", *measures]]
    for key, some in groups.items():
        known = dict(zip(IDENTITY, key, strict=False))
        values = [[getattr(one, name) for one in some] for name in measures]
        # If all bodies are rattlers, no mean over the others exists.
        found = [text(Mean.of(of)) if np.isfinite(of).all() else "-" for of in values]
        lines.append([*(known[name] for name in settings), str(len(some)), *found])
    return lines


def text(one: Mean) -> str:
    """Return a mean with its interval, or the only number that there is."""
    return str(one) if math.isfinite(one.half) else f"{one.value:.3g} (one start)"


def means(rows: Sequence[PackedRow], by: Sequence[str], name: str) -> dict[tuple[Any, ...], Mean]:
    """Return the mean of a measure over seeds, by the values of columns."""
    groups: dict[tuple[Any, ...], list[float]] = {}
    for one in rows:
        groups.setdefault(tuple(getattr(one, key) for key in by), []).append(getattr(one, name))
    return {key: Mean.of(values) for key, values in groups.items()}
