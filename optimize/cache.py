"""Every finished evaluation, on the disk at once, shared by runs and processes, never lost to a kill.

FILE          HDF5: one row per evaluation, and tables (settings, logbooks, reports). Whole at every instant,
              because it is only ever replaced by a complete new one.
FILE.journal  evaluations finished since; folded into FILE at the end of a generation and when it grows large.
FILE.lock     held by whoever reads or writes either.

A kill between replacing FILE and emptying the journal leaves evaluations in both: they count once, by key.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from optimize import store
from optimize.journal import Journal
from optimize.record import Record
from optimize.store import Table
from tisim.durable import locked, replace_file
from tisim.errors import must

FOLD_BYTES = 8 << 20  # of journal; above this, replaying it costs more than rewriting the HDF5 file


class Cache:
    """The evaluations in a file, kept in memory and in step with other processes that use the same file.

    path : the HDF5 file; made on the first fold if there is none. Its folder is made if missing.
    Raises InputError if path is cut short or not a cache's file: nothing is then written.
    Use as a context manager, or close it, so that the journal is folded in.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._journal = Journal(self.path.with_name(self.path.name + ".journal"))
        self._lock = self.path.with_name(self.path.name + ".lock")
        self._records: dict[str, Record] = {}
        self._pending: dict[str, Table] = {}
        self._version: tuple[int, ...] | None = None
        self._end = 0
        if self.path.exists():
            with store.opened(self.path):
                pass  # before a lock file is left beside a file that is not ours
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.refresh()

    def __enter__(self) -> Cache:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self._records)

    def records(self) -> list[Record]:
        """All evaluations, oldest first."""
        return list(self._records.values())

    def get(self, key: str) -> Record | None:
        """The evaluation of that key, as of the last refresh, put or fold."""
        return self._records.get(key)

    def refresh(self) -> None:
        """Take in what other processes have stored since."""
        with locked(self._lock, exclusive=False):
            self._refresh()

    def put(self, record: Record) -> Record:
        """Store an evaluation; on return it is on the disk. Returns the one that counts: its key's first.

        RunError if the disk is full; everything stored before is then intact.
        """
        with locked(self._lock, exclusive=True):
            self._refresh()
            if record.key not in self._records:
                self._end = self._journal.append(self._end, record.payload())
                self._records[record.key] = record
                if self._end > FOLD_BYTES:
                    self._fold()
            return self._records[record.key]

    def put_table(
        self, name: str, columns: Mapping[str, Sequence[Any]], attrs: Mapping[str, Any] | None = None
    ) -> None:
        """Store a table at the next fold, in place of one of the same name; "a/b" nests.

        InputError if the columns differ in length.
        """
        first = name.split("/")[0]
        must(
            bool(first) and first != store.ROWS, "table name", f"non-empty and not below {store.ROWS!r}", name
        )
        self._pending[name] = Table(dict(columns), dict(attrs or {}))

    def table(self, name: str) -> Table:
        """A stored table. InputError if there is none of that name."""
        if name in self._pending:
            return self._pending[name]
        must(name in self.tables(), "table name", f"one of {self.tables()}", name)
        with locked(self._lock, exclusive=False), store.opened(self.path) as file:
            return store.read_table(file, name)

    def tables(self) -> list[str]:
        """Names of all tables, stored or waiting for the next fold."""
        with locked(self._lock, exclusive=False):
            if not self.path.exists():
                return sorted(self._pending)
            with store.opened(self.path) as file:
                return sorted({*store.tables(file), *self._pending})

    def fold(self, *, always: bool = False) -> None:
        """Write journal and waiting tables into the HDF5 file.

        RunError if the disk is full; everything stored before is then intact.
        """
        with locked(self._lock, exclusive=True):
            self._refresh()
            if always or self._journal.size() or self._pending:
                self._fold()

    def close(self) -> None:
        """Fold."""
        self.fold()

    def _fold(self) -> None:
        old = self.path if self.path.exists() else None
        replace_file(self.path, store.image(old, self.records(), self._pending))
        self._journal.clear()
        self._pending, self._version, self._end = {}, self._file_version(), 0

    def _file_version(self) -> tuple[int, ...] | None:
        if not self.path.exists():
            return None
        stat = self.path.stat()
        return stat.st_ino, stat.st_mtime_ns, stat.st_size

    def _refresh(self) -> None:
        version = self._file_version()
        if version != self._version or self._journal.size() < self._end:
            self._records, self._end, self._version = {}, 0, version
            if version is not None:
                with store.opened(self.path) as file:
                    rows, damaged = store.read_rows(file)
                self._take(rows, damaged)
        found = self._journal.read(self._end)
        self._take(map(Record.parse, found.payloads), [f"journal, byte {offset}" for offset in found.damaged])
        self._end = found.end

    def _take(self, records: Any, damaged: Sequence[str]) -> None:
        for record in records:
            self._records.setdefault(record.key, record)
        if damaged:
            text = f"{self.path}: {len(damaged)} damaged evaluation(s) are ignored and will be run again"
            warnings.warn(text, RuntimeWarning, stacklevel=4)


@dataclass(frozen=True)
class VerifyReport:
    """What verify found. rows, journal : whole records in the HDF5 file and in the journal.

    damaged : every row, table or stretch of journal that is not what was written.
    torn : bytes of an unfinished record at the journal's end (a killed writer; harmless).
    duplicates : records stored more than once (a kill during a fold; harmless).
    conflicts : keys stored with different fitnesses: the evaluation is not reproducible.
    """

    rows: int
    journal: int
    damaged: list[str]
    torn: int
    duplicates: int
    conflicts: list[str]

    @property
    def ok(self) -> bool:
        """Nothing damaged and nothing in conflict."""
        return not self.damaged and not self.conflicts


def _existing(path: str | Path) -> Path:
    path = Path(path)
    journal = path.with_name(path.name + ".journal")
    must(path.is_file() or journal.is_file(), "cache file", "an existing file", str(path))
    return path


def existing(path: str | Path) -> Cache:
    """The cache of a file that is there already. InputError if there is no such file."""
    return Cache(_existing(path))


def verify(path: str | Path) -> VerifyReport:
    """Check every row, table and journal frame of an existing cache file; changes nothing.

    InputError if the file does not exist, is cut short or is not a cache's.
    """
    path = _existing(path)
    journal = Journal(path.with_name(path.name + ".journal"))
    with locked(path.with_name(path.name + ".lock"), exclusive=False):
        rows: list[Record] = []
        damaged: list[str] = []
        if path.exists():
            with store.opened(path) as file:
                rows, damaged = store.read_rows(file)
                damaged += store.damaged_tables(file)
        found = journal.read()
    frames = [Record.parse(payload) for payload in found.payloads]
    first: dict[str, Record] = {}
    for record in (*rows, *frames):
        first.setdefault(record.key, record)
    conflicts = {r.key for r in (*rows, *frames) if repr(r.values) != repr(first[r.key].values)}
    return VerifyReport(
        rows=len(rows),
        journal=len(frames),
        damaged=damaged + [f"journal, byte {offset}: not a whole record" for offset in found.damaged],
        torn=found.torn,
        duplicates=len(rows) + len(frames) - len(first),
        conflicts=sorted(conflicts),
    )


def compact(path: str | Path) -> int:
    """Fold an existing cache file's journal, drop duplicates and damaged rows; return how many are kept."""
    cache = existing(path)
    cache.fold(always=True)
    return len(cache)
