"""A cache file, such as that of a search, is checked record by record, or made small again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from optimize.storage import hdf5_store, salvage
from optimize.storage.cache import Cache, existing_files, file_content, journal_records
from optimize.storage.journal import Journal, Mark
from optimize.storage.record import Record
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
        rows: list[Record] = []
        damaged: list[str] = []
        content = file_content(path)
        if content is not None:
            with hdf5_store.open_evaluations(path) as file:
                rows, damaged = hdf5_store.read_rows(file)
                names = hdf5_store.damaged_tables(file)
                damaged += [f"table {name}: its checksum does not fit" for name in names]
        scanned, mark = Journal(journal).read(), Mark.read(lock)
    frames, not_records = journal_records(scanned)
    loss = None if mark is None else mark.loss(content, scanned)
    damaged += [*not_records, *([loss] if loss else [])]
    by_key: dict[str, Record] = {}
    for record in (*rows, *frames):
        by_key.setdefault(record.key, record)
    conflicts = {r.key for r in (*rows, *frames) if repr(r.values) != repr(by_key[r.key].values)}
    return VerifyReport(
        rows=len(rows),
        journal=len(frames),
        damaged=damaged,
        torn=scanned.torn,
        duplicates=len(rows) + len(frames) - len(by_key),
        conflicts=sorted(conflicts),
    )


def compact(path: str | Path) -> int:
    """Fold an existing cache file's journal, drop what is damaged or double; return how many are kept.

    A file that is damaged as a whole is kept as FILE.damaged; FILE then has what could be read of it.
    """
    file, _, lock = existing_files(path)
    salvage.repair(file, lock)
    cache = Cache(file)
    cache.compact()
    return len(cache)
