"""The cache stores every finished evaluation on disk at once; processes share it, and a killed process loses
none.

FILE          HDF5: evaluations as columns, and tables (settings, logbooks, best designs). It is complete at
              every instant, because it is only ever replaced by a complete new file.
FILE.journal  newer evaluations and rows of tables; merged (folded) into FILE when it exceeds a share of it.
FILE.lock     locked by every process that reads or writes the others; stores the length of the journal.

Storing an evaluation therefore writes only that evaluation, not the whole file. If a process is killed
between replacing FILE and emptying the journal, evaluations are in both; they count once, by key.
"""

from __future__ import annotations

import os
import warnings
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tisim.errors import Words, must
from tisim.files.atomic import locked, replace_file
from tisim.files.output_folder import ensure_writable
from tisim.files.regular_file import file_status, is_folder, open_descriptor
from tisim.optimize.storage import hdf5_store
from tisim.optimize.storage.hdf5_store import Content
from tisim.optimize.storage.journal import Journal, Mark, TableRows
from tisim.optimize.storage.record import Record
from tisim.optimize.storage.runs_table import RunsTable, tabulated
from tisim.optimize.storage.table import Hdf5Table

FOLD_BYTES = 64 << 10
"""The journal is folded when it is longer than this, in bytes, ..."""
FOLD_SHARE = 0.25
"""... and longer than this share of the HDF5 file. Each stored byte is then written about five times in
total, however large the file, and the file is never far behind."""
TAIL = 4096
"""The checksum of a file is within this number of bytes from its end."""


class Cache:
    """The evaluations of a file, held in memory and kept up to date with other processes that use the file.

    path : the HDF5 file; made on the first fold if there is none. Its folder is made if missing.

    Raises InputError if path is truncated, damaged, not a cache file or cannot be opened; nothing is then
    written. Warns of single damaged or lost evaluations, which are run again. Use it as a context manager, or
    close it, to fold the journal.
    """

    def __init__(self, path: str | Path) -> None:
        self.path, journal, self._lock = cache_files(path)
        self._journal = Journal(journal)
        self._runs: list[RunsTable] = []
        self._newer: dict[str, Record] = {}
        self._tables: dict[str, Hdf5Table] = {}
        self._version: tuple[int, ...] | None = None
        self._content: tuple[int, ...] | None = None
        self._end = self._frames = 0
        first = None
        if (version := file_version(self.path)) is not None:
            # A file that is not a cache is refused before a lock file is created beside it.
            first = version, hdf5_store.read(self.path)
        if not is_folder(self.path.parent):
            ensure_writable(self.path.parent)
        with locked(self._lock, exclusive=False):
            self._refresh(first)

    def __enter__(self) -> Cache:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __len__(self) -> int:
        return sum(map(len, self._runs)) + len(self._newer)

    def runs(self) -> list[RunsTable]:
        """Return all evaluations in the file as columns, a table for each problem."""
        return tabulated(self._runs, self._newer.values())

    def records(self) -> list[Record]:
        """Return all evaluations in the file, grouped by problem and oldest first."""
        return [*(record for part in self._runs for record in part.records()), *self._newer.values()]

    def get(self, key: str) -> Record | None:
        """Return the evaluation with this key, as of the last refresh, put or fold; None if there is none."""
        if key in self._newer:
            return self._newer[key]
        part = next((part for part in self._runs if key in part.rows), None)
        return None if part is None else part.record(part.rows[key])

    def refresh(self) -> None:
        """Read the evaluations that other processes have stored since."""
        with locked(self._lock, exclusive=False):
            self._refresh()

    def put(self, record: Record) -> Record:
        """Store an evaluation on disk before returning; return the valid one, which is the first with its
        key.

        RunError if the disk is full; everything stored before is then intact.
        """
        with locked(self._lock, exclusive=True) as lock:
            self._refresh()
            known = self.get(record.key)
            if known is None:
                self._append(lock, record.payload(), evaluations=1)
                self._newer[record.key] = record
                self._fold_if_long()
            return known or record

    def put_table(
        self,
        name: str,
        columns: Mapping[str, Sequence[Any]],
        attrs: Mapping[str, Any] | None = None,
        about: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> None:
        """Store a table on disk before returning, in place of one with the same name; "a/b" nests.

        Only new rows are written. about : attributes of columns, such as their unit. InputError if the
            columns differ in length, RunError if the disk is full; everything stored before is then intact.
        """
        first = name.split("/")[0]
        must(
            bool(first) and first != hdf5_store.EVALUATIONS,
            "table name",
            f"non-empty and not below {hdf5_store.EVALUATIONS!r}",
            name,
        )
        # The caller may later add to its lists.
        own = {heading: list(column) for heading, column in columns.items()}
        table = Hdf5Table(own, dict(attrs or {}), dict(about or {}))
        with locked(self._lock, exclusive=True) as lock:
            self._refresh()
            rows = TableRows.between(name, self._tables.get(name), table)
            if rows is not None:
                self._append(lock, rows.payload(), evaluations=0)
                self._tables[name] = table
                self._fold_if_long()

    def table(self, name: str) -> Hdf5Table:
        """Return a table. InputError if there is none of that name, or it is damaged."""
        self.refresh()
        must(name in self._tables, "table name", f"one of {sorted(self._tables)}", name)
        rule = "whole ('tisim cache --compact' drops it)"
        must(self._tables[name].intact, f"table {name}", rule, Words("damage"))
        return self._tables[name]

    def attributes(self) -> dict[str, Mapping[str, Any]]:
        """Return the attributes of all tables by name."""
        self.refresh()
        return {name: self._tables[name].attrs for name in sorted(self._tables)}

    def tables(self) -> list[str]:
        """Return the names of all tables."""
        return list(self.attributes())

    def fold(self) -> None:
        """Merge the journal into the HDF5 file.

        RunError if the disk is full; everything stored before is then intact.
        """
        with locked(self._lock, exclusive=True):
            self._refresh()
            if self._journal.size():
                self._fold()

    def compact(self) -> None:
        """Fold, and drop damaged and duplicate records."""
        with locked(self._lock, exclusive=True):
            self._refresh()
            self._tables = {name: table for name, table in self._tables.items() if table.intact}
            self._runs = [part.different() for part in self._runs]
            self._fold()

    def close(self) -> None:
        """Fold the journal into the HDF5 file, and close the cache."""
        self.fold()

    def _append(self, lock: int, payload: bytes, evaluations: int) -> None:
        self._end = self._journal.append(self._end, payload)
        self._frames += evaluations
        Mark(self._content, self._end, self._frames).write(lock)

    def _fold_if_long(self) -> None:
        size = 0 if self._version is None else self._version[-1]
        if self._end > max(FOLD_BYTES, FOLD_SHARE * size):
            self._fold()

    def _fold(self) -> None:
        runs = self.runs()
        replace_file(self.path, hdf5_store.build_image(runs, self._tables))
        self._journal.clear()
        self._runs, self._newer, self._end, self._frames = runs, {}, 0, 0
        self._version, self._content = file_version(self.path), file_content(self.path)

    def _refresh(self, read: tuple[tuple[int, ...], Content] | None = None) -> None:
        """Read new data. read : the file as read earlier, with its version at that time."""
        version = file_version(self.path)
        if version != self._version or self._journal.size() < self._end:
            self._newer, self._end, self._frames = {}, 0, 0
            self._version, self._content = version, file_content(self.path)
            found = Content()
            if version is not None:
                found = read[1] if read is not None and read[0] == version else hdf5_store.read(self.path)
            self._runs, self._tables = found.runs, found.tables
            self._warn(found.damaged)
        first = self._end == 0
        entries = self._journal.read(self._tables, self._end)
        for record in entries.records:
            if self.get(record.key) is None:
                self._newer[record.key] = record
        self._tables = entries.tables
        self._warn(entries.damaged)
        self._end, self._frames = entries.end, self._frames + len(entries.records)
        mark = Mark.read(self._lock) if first else None
        if mark is not None and (loss := mark.loss(self._content, entries)):
            warnings.warn(
                f"{self.path}: {loss}; lost evaluations will be run again", RuntimeWarning, stacklevel=3
            )

    def _warn(self, damaged: Sequence[str]) -> None:
        if damaged:
            text = f"{self.path}: {len(damaged)} damaged evaluation(s) are ignored and will be run again"
            warnings.warn(text, RuntimeWarning, stacklevel=4)


def cache_files(path: str | Path) -> tuple[Path, Path, Path]:
    """Return the paths of the HDF5 file, its journal and its lock."""
    path = Path(path)
    must(bool(path.name), "cache file", "a file", str(path))
    return path, path.with_name(f"{path.name}.journal"), path.with_name(f"{path.name}.lock")


def file_version(path: Path) -> tuple[int, ...] | None:
    """Return numbers that change whenever the HDF5 file is replaced; None if there is no file."""
    status = file_status(path)
    return None if status is None else (status.st_ino, status.st_mtime_ns, status.st_size)


def file_content(path: Path) -> tuple[int, ...] | None:
    """Return numbers that identify the content of the HDF5 file, equal for a copy: its last bytes, which
    contain its checksum. None if there is no file."""
    status = file_status(path)
    if status is None:
        return None
    with os.fdopen(open_descriptor(path, os.O_RDONLY), "rb") as file:
        file.seek(max(0, status.st_size - TAIL))
        return zlib.crc32(file.read()), status.st_size


def existing_files(path: str | Path) -> tuple[Path, Path, Path]:
    """Return the ``cache_files`` of an existing cache. InputError if there is no such file."""
    file, journal, lock = cache_files(path)
    status = file_status(file) or file_status(journal)
    must(status is not None, "cache file", "an existing file", str(path))
    return file, journal, lock


def existing(path: str | Path) -> Cache:
    """Return the cache of an existing file. InputError if there is no such file."""
    return Cache(existing_files(path)[0])
