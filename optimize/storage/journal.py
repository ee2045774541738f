"""The write-ahead journal: a file of framed, checksummed payloads (see tisim/files/checksum.py).

The payloads are evaluations and rows of tables. The lock file beside it stores the length up to which the
journal was written; if the journal is shorter, the difference was lost.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Mapping
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from tisim.files.atomic import append_at
from tisim.files.checksum import Scan, frame, scan
from tisim.files.regular_file import content, file_status, open_descriptor
from tisim.optimize.storage.record import Record, plain
from tisim.optimize.storage.table import Hdf5Table


@dataclass(frozen=True)
class Mark:
    """The length up to which a journal was written.

    base : numbers that identify the content of its HDF5 file; None if there is no such file.
    end : length, bytes. frames : number of evaluations within this length.
    """

    base: tuple[int, ...] | None
    end: int
    frames: int

    def write(self, lock: int) -> None:
        """Write the mark into the open lock file. A failure is ignored, since no stored record depends on
        it."""
        with contextlib.suppress(OSError):
            os.pwrite(lock, frame(json.dumps(astuple(self)).encode()), 0)

    @classmethod
    def read(cls, lock: Path) -> Mark | None:
        """Return the mark in a lock file, None if there is no valid one."""
        try:
            base, end, frames = json.loads(scan(content(lock) or b"").payloads[0])
            return cls(None if base is None else tuple(base), int(end), int(frames))
        except (IndexError, ValueError, TypeError):
            return None

    def loss(self, base: tuple[int, ...] | None, found: Entries) -> str | None:
        """Return a description of the data lost from a journal that was read from its beginning; None if
        complete."""
        if self.base != base or found.end >= self.end:
            return None
        count = self.frames - len(found.records) - len(found.damaged)
        what = f"{count} evaluation(s)" if count > 0 else "rows of a table"
        return f"journal, byte {found.end}: {what} cut off, {self.end - found.end} bytes"


@dataclass(frozen=True)
class TableRows:
    """Rows that were appended to a table after its first ``kept`` rows, or a whole new table.

    attrs, about : attributes of a new table and its columns; None if they did not change.

    The logbook of a search thus costs one row for each generation, not all rows.
    """

    table: str
    kept: int
    columns: Mapping[str, list[Any]]
    attrs: Mapping[str, Any] | None = None
    about: Mapping[str, Mapping[str, Any]] | None = None

    @classmethod
    def between(cls, name: str, old: Hdf5Table | None, new: Hdf5Table) -> TableRows | None:
        """Return the rows that turn the old table (or None) into the new one; None if they are equal."""
        kept = None if old is None else old.rows_kept_in(new)
        if kept is None:
            return cls(name, 0, {head: list(c) for head, c in new.columns.items()}, new.attrs, new.about)
        if kept == len(new):
            return None
        return cls(name, kept, {head: list(column[kept:]) for head, column in new.columns.items()})

    def added_to(self, old: Hdf5Table | None) -> Hdf5Table | None:
        """Return the table with these rows added. If the old table is too short, it is returned unchanged."""
        if self.attrs is not None:
            return Hdf5Table(self.columns, self.attrs, self.about or {})
        if old is None or len(old) < self.kept:
            return old
        return old.continued(self.kept, self.columns)

    def payload(self) -> bytes:
        """Return it as ASCII JSON."""
        return json.dumps(vars(self), separators=(",", ":"), default=plain).encode("ascii")

    @classmethod
    def parse(cls, payload: bytes) -> TableRows:
        """Return the rows in a ``payload``. ValueError if it contains none."""
        _RowsForm.model_validate_json(payload)
        return cls(**json.loads(payload))


class _RowsForm(BaseModel):
    """Validates the payload of TableRows."""

    model_config = ConfigDict(strict=True, extra="forbid")
    table: str
    kept: int = Field(ge=0)
    columns: dict[str, list[Any]]
    attrs: dict[str, Any] | None
    about: dict[str, dict[str, Any]] | None


@dataclass(frozen=True)
class Entries:
    """The content of a part of a journal.

    records : its evaluations. tables : all tables, with its rows added. damaged : descriptions of invalid
        frames. end, torn : see Scan.
    """

    records: list[Record] = field(default_factory=list)
    tables: dict[str, Hdf5Table] = field(default_factory=dict)
    damaged: list[str] = field(default_factory=list)
    end: int = 0
    torn: int = 0


class Journal:
    """The journal file at path. Callers hold the lock (tisim.files.atomic.locked)."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def size(self) -> int:
        """Return the number of bytes in the file, 0 if there is none."""
        info = file_status(self.path)
        return 0 if info is None else info.st_size

    def read(self, tables: Mapping[str, Hdf5Table], offset: int = 0) -> Entries:
        """Return the content from byte offset on, which must be 0 or the end of an earlier read.

        tables : the tables before these entries.
        """
        if self.size() <= offset:
            return Entries(tables=dict(tables), end=offset)
        with os.fdopen(open_descriptor(self.path, os.O_RDONLY), "rb") as file:
            file.seek(offset)
            return entries(scan(file.read(), offset), tables)

    def append(self, end: int, payload: bytes) -> int:
        """Write one frame after the last complete one, cutting off a torn tail; return the new end.

        The frame is on disk on return. RunError if the disk is full; earlier frames are then intact.
        """
        return append_at(self.path, end, frame(payload))

    def clear(self) -> None:
        """Empty the file."""
        if self.size():
            append_at(self.path, 0, b"")


def entries(scanned: Scan, tables: Mapping[str, Hdf5Table]) -> Entries:
    """Return the content of the frames; tables : the tables before them."""
    damaged = [f"journal, byte {offset}: not a whole record" for offset in scanned.damaged]
    found = Entries([], dict(tables), damaged, scanned.end, scanned.torn)
    for number, payload in enumerate(scanned.payloads):
        try:
            if payload.startswith(b'{"table":'):
                rows = TableRows.parse(payload)
                table = rows.added_to(found.tables.get(rows.table))
                if table is not None:
                    found.tables[rows.table] = table
            else:
                found.records.append(Record.parse(payload))
        except ValueError:
            damaged.append(f"journal, frame {number}: no evaluation")
    return found
