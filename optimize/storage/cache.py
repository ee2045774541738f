"""The cache keeps every finished evaluation on the disk at once, shared by processes, never lost to a kill.

FILE          HDF5: one row per evaluation, and tables (settings, logbooks, reports). Whole at every instant,
              because it is only ever replaced by a complete new one.
FILE.journal  evaluations finished since; folded into FILE at the end of a generation and when it grows large.
FILE.lock     held by whoever reads or writes either; says how far the journal had been written.

A kill between replacing FILE and emptying the journal leaves evaluations in both: they count once, by key.
"""

from __future__ import annotations

import os
import warnings
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from optimize.storage import hdf5_store
from optimize.storage.hdf5_store import Hdf5Table
from optimize.storage.journal import Journal, Mark
from optimize.storage.record import Record
from tisim.errors import must
from tisim.files.atomic import locked, replace_file
from tisim.files.framing import Scan
from tisim.files.ownership import ensure_writable
from tisim.files.regular_file import file_status, is_folder, open_descriptor

FOLD_BYTES = 8 << 20
"""Length of a journal, bytes, above which replaying it costs more than rewriting the HDF5 file."""
TAIL = 4096
"""At the end of a file, within so many bytes, is its checksum."""


class Cache:
    """A cache holds the evaluations of a file in memory, in step with other processes that use the file.

    path : the HDF5 file; made on the first fold if there is none. Its folder is made if missing.
    Raises InputError if path is cut short, damaged, not a cache's file or none that may be opened: nothing is
    then written. Warns of single evaluations that are damaged or lost; those are run again.
    Use as a context manager, or close it, so that the journal is folded in.
    """

    def __init__(self, path: str | Path) -> None:
        self.path, journal, self._lock = cache_files(path)
        self._journal = Journal(journal)
        self._records: dict[str, Record] = {}
        self._pending: dict[str, Hdf5Table] = {}
        self._version: tuple[int, ...] | None = None
        self._content: tuple[int, ...] | None = None
        self._end = self._frames = 0
        if file_status(self.path) is not None:
            # A file that is no cache's is refused before a lock file is left beside it.
            with hdf5_store.open_evaluations(self.path):
                pass
        if not is_folder(self.path.parent):
            ensure_writable(self.path.parent)
        self.refresh()

    def __enter__(self) -> Cache:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self._records)

    def records(self) -> list[Record]:
        """Return all evaluations in the file, oldest first."""
        return list(self._records.values())

    def get(self, key: str) -> Record | None:
        """Return the evaluation of that key, as of the last refresh, put or fold; None if there is none."""
        return self._records.get(key)

    def refresh(self) -> None:
        """Take in what other processes have stored since."""
        with locked(self._lock, exclusive=False):
            self._refresh()

    def put(self, record: Record) -> Record:
        """Store an evaluation, which on return is on the disk; return the one that counts, its key's first.

        RunError if the disk is full; everything stored before is then intact.
        """
        with locked(self._lock, exclusive=True) as lock:
            self._refresh()
            if record.key not in self._records:
                self._end = self._journal.append(self._end, record.payload())
                self._frames += 1
                Mark(self._content, self._end, self._frames).write(lock)
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
            bool(first) and first != hdf5_store.EVALUATIONS,
            "table name",
            f"non-empty and not below {hdf5_store.EVALUATIONS!r}",
            name,
        )
        self._pending[name] = Hdf5Table(dict(columns), dict(attrs or {}))

    def table(self, name: str) -> Hdf5Table:
        """Return a table, stored or waiting for the next fold. InputError if there is none of that name."""
        if name in self._pending:
            return self._pending[name]
        must(name in self.tables(), "table name", f"one of {self.tables()}", name)
        with locked(self._lock, exclusive=False), hdf5_store.open_evaluations(self.path) as file:
            return hdf5_store.read_table(file, name)

    def attributes(self) -> dict[str, Mapping[str, Any]]:
        """Return the attributes of all tables by name, stored or waiting for the next fold."""
        attributes: dict[str, Mapping[str, Any]] = {}
        with locked(self._lock, exclusive=False):
            if file_status(self.path) is not None:
                with hdf5_store.open_evaluations(self.path) as file:
                    attributes = {name: hdf5_store.attributes(file[name]) for name in hdf5_store.tables(file)}
        return attributes | {name: table.attrs for name, table in self._pending.items()}

    def tables(self) -> list[str]:
        """Return the names of all tables, stored or waiting for the next fold."""
        return sorted(self.attributes())

    def fold(self) -> None:
        """Write journal and waiting tables into the HDF5 file.

        RunError if the disk is full; everything stored before is then intact.
        """
        with locked(self._lock, exclusive=True):
            self._refresh()
            if self._journal.size() or self._pending:
                self._fold()

    def compact(self) -> None:
        """Fold, and leave out what is damaged or double."""
        with locked(self._lock, exclusive=True):
            self._refresh()
            self._fold(damaged=False)

    def close(self) -> None:
        """Fold what is waiting into the HDF5 file."""
        self.fold()

    def _fold(self, *, damaged: bool = True) -> None:
        old = None if file_status(self.path) is None else self.path
        replace_file(self.path, hdf5_store.build_image(old, self.records(), self._pending, damaged))
        self._journal.clear()
        self._pending, self._end, self._frames = {}, 0, 0
        self._version, self._content = file_version(self.path), file_content(self.path)

    def _refresh(self) -> None:
        version = file_version(self.path)
        if version != self._version or self._journal.size() < self._end:
            self._records, self._end, self._frames = {}, 0, 0
            self._version, self._content = version, file_content(self.path)
            if version is not None:
                with hdf5_store.open_evaluations(self.path) as file:
                    self._take(*hdf5_store.read_rows(file))
        first = self._end == 0
        scanned = self._journal.read(self._end)
        self._take(*journal_records(scanned))
        self._end, self._frames = scanned.end, self._frames + len(scanned.payloads)
        mark = Mark.read(self._lock) if first else None
        if mark is not None and (loss := mark.loss(self._content, scanned)):
            warnings.warn(
                f"{self.path}: {loss}; what is lost will be run again", RuntimeWarning, stacklevel=4
            )

    def _take(self, records: Sequence[Record], damaged: Sequence[str]) -> None:
        for record in records:
            self._records.setdefault(record.key, record)
        if damaged:
            text = f"{self.path}: {len(damaged)} damaged evaluation(s) are ignored and will be run again"
            warnings.warn(text, RuntimeWarning, stacklevel=4)


def cache_files(path: str | Path) -> tuple[Path, Path, Path]:
    """Return the paths of the HDF5 file, its journal and its lock."""
    path = Path(path)
    must(bool(path.name), "cache file", "a file", str(path))
    return path, path.with_name(f"{path.name}.journal"), path.with_name(f"{path.name}.lock")


def file_version(path: Path) -> tuple[int, ...] | None:
    """Return numbers that tell one state of the HDF5 file from another; None where there is no file."""
    status = file_status(path)
    return None if status is None else (status.st_ino, status.st_mtime_ns, status.st_size)


def file_content(path: Path) -> tuple[int, ...] | None:
    """Return numbers that tell the content of the HDF5 file from others, also in a copy: those of its last
    bytes, in which its checksum is; None where there is no file."""
    status = file_status(path)
    if status is None:
        return None
    with os.fdopen(open_descriptor(path, os.O_RDONLY), "rb") as file:
        file.seek(max(0, status.st_size - TAIL))
        return zlib.crc32(file.read()), status.st_size


def journal_records(scanned: Scan) -> tuple[list[Record], list[str]]:
    """Return the evaluations in a part of a journal, and a description of each thing in it that is none."""
    records = []
    damaged = [f"journal, byte {offset}: not a whole record" for offset in scanned.damaged]
    for number, payload in enumerate(scanned.payloads):
        try:
            records.append(Record.parse(payload))
        except ValueError:
            damaged.append(f"journal, frame {number}: no evaluation")
    return records, damaged


def existing_files(path: str | Path) -> tuple[Path, Path, Path]:
    """Return the ``cache_files`` of a cache that is there already. InputError if there is no such file."""
    file, journal, lock = cache_files(path)
    status = file_status(file) or file_status(journal)
    must(status is not None, "cache file", "an existing file", str(path))
    return file, journal, lock


def existing(path: str | Path) -> Cache:
    """Return the cache of a file that is there already. InputError if there is no such file."""
    return Cache(existing_files(path)[0])
