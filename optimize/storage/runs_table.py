"""Evaluations as columns: a table for the runs of one problem whose designs have the same genes.

A hundred thousand evaluations are read, checked and written column by column; Records are made only on
request.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tisim.optimize.storage.record import Gene, Record, canonical, plain
from tisim.optimize.storage.table import text_column

Column = NDArray[Any]
KINDS: Mapping[str, Any] = {
    "key": bytes, "start": np.int64, "seed": np.int64, "ok": np.uint8, "reason": bytes, "wall_s": np.float64,
    "created": np.float64, "work": bytes,
}  # fmt: skip
"""The columns of all evaluations, in addition to genes and values."""
Layout = tuple[str, frozenset[tuple[str, str]]]
"""The problem's name, and each gene with the kind of its values (numbers "f", flags "b", text "S"). All
evaluations of a table share it. Integers are stored as numbers."""


@dataclass(frozen=True)
class RunsTable:
    """A table with a row for each evaluation of one problem.

    facts : the columns of KINDS.
    genes, values : a column for each gene and each value, by name, in order.

    Text is stored as UTF-8 bytes of one length for a column. A value that an evaluation does not have is NaN.
    """

    problem: str
    facts: Mapping[str, Column]
    genes: Mapping[str, Column]
    values: Mapping[str, Column]

    def __len__(self) -> int:
        return len(self.facts["key"])

    @property
    def layout(self) -> Layout:
        """Return the layout; only tables of equal layout can be joined."""
        kinds = {name: column.dtype.kind for name, column in self.genes.items()}
        return self.problem, frozenset((name, kind.replace("i", "f")) for name, kind in kinds.items())

    @cached_property
    def keys(self) -> list[str]:
        """The key of each row."""
        return [key.decode(errors="replace") for key in self.facts["key"].tolist()]

    @cached_property
    def rows(self) -> Mapping[str, int]:
        """The first row of each key."""
        return dict(zip(reversed(self.keys), range(len(self) - 1, -1, -1), strict=True))

    def different(self) -> RunsTable:
        """Return the table with one row for each key, the first that has it."""
        return self.chosen(np.isin(np.arange(len(self)), list(self.rows.values())))

    def designs(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the row of the first run of each different design, ascending, and the design's index for
        each row."""
        designs = packed(self.genes.values())
        same_bytes = designs.view(f"V{designs.shape[1]}").ravel()
        _, first, design = np.unique(same_bytes, return_index=True, return_inverse=True)
        order = np.argsort(first)
        number = np.empty(len(first), dtype=int)
        number[order] = np.arange(len(first))
        return first[order], number[design]

    def record(self, row: int) -> Record:
        """Return the evaluation in a row. ValueError if its text is invalid."""
        facts = {name: _plain(column[row]) for name, column in self.facts.items()}
        return Record(
            **{**facts, "ok": bool(facts["ok"]), "work": json.loads(facts["work"])},
            problem=self.problem,
            values={name: float(column[row]) for name, column in self.values.items()},
            design={name: _plain(column[row]) for name, column in self.genes.items()},
        )

    def records(self) -> list[Record]:
        """Return all evaluations."""
        return [self.record(row) for row in range(len(self))]

    def checksums(self) -> NDArray[np.uint32]:
        """Return the CRC-32 of each row: the bytes of its cells in order, preceded by the names of problem
        and columns."""
        cells = packed([*self.facts.values(), *self.genes.values(), *self.values.values()])
        start = zlib.crc32(canonical([self.problem, list(self.genes), list(self.values)]))
        return np.array([zlib.crc32(row, start) for row in cells], dtype=np.uint32)

    def chosen(self, rows: NDArray[np.bool_]) -> RunsTable:
        """Return the table of these rows."""
        parts = ({n: column[rows] for n, column in c.items()} for c in (self.facts, self.genes, self.values))
        return RunsTable(self.problem, *parts)

    def joined(self, other: RunsTable) -> RunsTable:
        """Return the table with the rows of another one, of the same layout, appended."""

        def value(part: RunsTable, name: str) -> Column:
            return part.values[name] if name in part.values else np.full(len(part), np.nan)

        names = dict.fromkeys((*self.values, *other.values))
        return RunsTable(
            self.problem,
            {name: np.concatenate([column, other.facts[name]]) for name, column in self.facts.items()},
            {name: np.concatenate([column, other.genes[name]]) for name, column in self.genes.items()},
            {name: np.concatenate([value(self, name), value(other, name)]) for name in names},
        )

    @classmethod
    def of(cls, records: Sequence[Record]) -> RunsTable:
        """Return the table of one or more evaluations that have one layout."""
        facts: dict[str, Column] = {}
        for name, kind in KINDS.items():
            cells = [getattr(record, name) for record in records]
            if name == "work":
                cells = [json.dumps(work, separators=(",", ":"), default=plain) for work in cells]
            facts[name] = text_column(cells) if kind is bytes else np.array(cells, dtype=kind)
        genes = {name: _gene_column([r.design[name] for r in records]) for name in records[0].design}
        names = dict.fromkeys(name for record in records for name in record.values)
        values = {name: np.array([r.values.get(name, np.nan) for r in records]) for name in names}
        return cls(records[0].problem, facts, genes, values)


def tabulated(tables: Sequence[RunsTable], records: Iterable[Record]) -> list[RunsTable]:
    """Return the tables with these evaluations appended, one table for each layout."""
    parts: dict[Layout, RunsTable] = {}
    by_layout: dict[Layout, list[Record]] = {}
    for record in records:
        by_layout.setdefault(_layout(record), []).append(record)
    for table in (*tables, *map(RunsTable.of, by_layout.values())):
        known = parts.get(table.layout)
        parts[table.layout] = table if known is None else known.joined(table)
    return list(parts.values())


def packed(columns: Iterable[Column]) -> NDArray[np.uint8]:
    """Return the concatenated bytes of the cells of each row, shape (rows, bytes)."""
    cells = [np.ascontiguousarray(c).view(np.uint8).reshape(len(c), c.dtype.itemsize) for c in columns]
    return np.ascontiguousarray(np.hstack(cells))


def _plain(cell: Any) -> Any:
    """Return a cell as a plain Python value."""
    value = cell.item()
    return value.decode() if isinstance(value, bytes) else value


def _gene_column(cells: Sequence[Gene]) -> Column:
    if isinstance(cells[0], str):
        return text_column([str(cell) for cell in cells])
    kinds = {type(cell) for cell in cells}
    return np.array(cells, dtype=np.bool_ if kinds == {bool} else np.int64 if kinds == {int} else np.float64)


def _layout(record: Record) -> Layout:
    kinds = {str: "S", bool: "b"}
    return record.problem, frozenset((n, kinds.get(type(value), "f")) for n, value in record.design.items())
