"""Maintenance of a cache file, such as search.h5: checking every record, and compacting."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from tisim.files.atomic import locked
from tisim.optimize.storage import hdf5_store, salvage
from tisim.optimize.storage.cache import Cache, existing_files, file_content
from tisim.optimize.storage.hdf5_store import Content
from tisim.optimize.storage.journal import Journal, Mark
from tisim.optimize.storage.record import Record


@dataclass(frozen=True)
class VerifyReport:
    """The result of ``verify`` on a cache file.

    rows, journal : numbers of intact records in the HDF5 file and in the journal.
    damaged : every row, table or part of the journal that was altered or cut off.
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
        """Return whether nothing is damaged and nothing in conflict."""
        return not self.damaged and not self.conflicts


def verify(path: str | Path) -> VerifyReport:
    """Check every row, table and journal frame of an existing cache file, without changing it.

    InputError if the file does not exist, is truncated or is not a cache file.
    """
    path, journal, lock = existing_files(path)
    with locked(lock, exclusive=False):
        base = file_content(path)
        stored = Content() if base is None else hdf5_store.read(path)
        found, mark = Journal(journal).read(stored.tables), Mark.read(lock)
    loss = None if mark is None else mark.loss(base, found)
    spoilt = [name for name, table in stored.tables.items() if not table.intact]
    tables = [f"table {name}: its checksum does not fit" for name in spoilt]
    rows, conflicts = sum(map(len, stored.runs)), set[str]()
    first: dict[str, Record] = {}
    for part in stored.runs:
        for row, key in enumerate(part.keys):
            if part.rows[key] != row and not _same(part.record(row), part.record(part.rows[key])):
                conflicts.add(key)
    for record in found.records:
        known = (part.record(part.rows[record.key]) for part in stored.runs if record.key in part.rows)
        if not _same(record, first.setdefault(record.key, next(known, record))):
            conflicts.add(record.key)
    different = set(first).union(*(part.rows for part in stored.runs))
    return VerifyReport(
        rows=rows,
        journal=len(found.records),
        damaged=[*stored.damaged, *tables, *found.damaged, *([loss] if loss else [])],
        torn=found.torn,
        duplicates=rows + len(found.records) - len(different),
        conflicts=sorted(conflicts),
    )


def _same(one: Record, other: Record) -> bool:
    """Return whether two evaluations have the same values; a missing value equals NaN."""
    values = [{name: v for name, v in r.values.items() if not math.isnan(v)} for r in (one, other)]
    return one.ok == other.ok and values[0] == values[1]


def compact(path: str | Path) -> int:
    """Fold the journal of an existing cache file, drop damaged and duplicate records; return the number kept.

    A file that is damaged as a whole is kept as FILE.damaged; FILE then contains the records that could be
    read from it.
    """
    file, _, lock = existing_files(path)
    salvage.repair(file, lock)
    cache = Cache(file)
    cache.compact()
    return len(cache)
