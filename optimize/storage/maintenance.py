"""A cache file, such as that of a search, is checked record by record, or made small again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from tisim.optimize.storage import hdf5_store, salvage
from tisim.optimize.storage.cache import Cache, existing_files, file_content
from tisim.optimize.storage.hdf5_store import Content
from tisim.optimize.storage.journal import Journal, Mark
from tisim.optimize.storage.record import Record

from tisim.files.atomic import locked


@dataclass(frozen=True)
class VerifyReport:
    """A report says what ``verify`` has found in a cache file.

    rows, journal : numbers of whole records in the HDF5 file and in the journal.
    damaged : every row, table or stretch of journal that is not what was written, or has been cut off.
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
    """Check every row, table and journal frame of an existing cache file, and change nothing.

    InputError if the file does not exist, is cut short or is not a cache's.
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
    """Return whether two evaluations have found the same; a value that there is not is as good as NaN."""
    values = [{name: v for name, v in r.values.items() if not math.isnan(v)} for r in (one, other)]
    return one.ok == other.ok and values[0] == values[1]


def compact(path: str | Path) -> int:
    """Fold an existing cache file's journal, drop what is damaged or double; return how many are kept.

    A file that is damaged as a whole is kept as FILE.damaged; FILE then has what could be read of it.
    """
    file, _, lock = existing_files(path)
    salvage.repair(file, lock)
    cache = Cache(file)
    cache.compact()
    return len(cache)
