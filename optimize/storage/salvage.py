"""Recovers the readable part of a cache file that is damaged, or that another program has written to.

HDF5 may crash or hang on such a file, so a separate process reads it, with a time limit. Rows and tables are
kept if their own checksums are right.
"""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
from pathlib import Path

import h5py

from tisim.errors import Words, must
from tisim.files.atomic import locked, replace_file
from tisim.files.checksum import verified
from tisim.files.regular_file import content, file_status
from tisim.optimize.storage import hdf5_store
from tisim.optimize.storage.runs_table import RunsTable
from tisim.optimize.storage.table import read_tables

TIME_LIMIT = 300.0
"""Time limit of that process, s; reading a million rows takes a tenth of it."""


def repair(path: Path, lock: Path) -> None:
    """Replace a damaged file by its readable part, and keep the damaged one as FILE.damaged.

    Nothing happens if the file is intact, or nothing can be read. InputError if FILE.damaged exists.
    """
    old = content(path)
    if old is None or verified(old) is not None:
        return
    salvaged = _salvage(old)
    if salvaged is None:
        return
    damaged_path = path.with_name(f"{path.name}.damaged")
    with locked(lock, exclusive=True):
        if content(path) == old:
            must(file_status(damaged_path) is None, "place for the damaged file", "free", str(damaged_path))
            replace_file(damaged_path, old)
            replace_file(path, salvaged)


def _salvage(old: bytes) -> bytes | None:
    command = [sys.executable, "-m", "tisim.optimize.storage.salvage"]
    try:
        process = subprocess.run(command, input=old, capture_output=True, timeout=TIME_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return None
    return process.stdout if process.returncode == 0 and verified(process.stdout) is not None else None


def _rebuild(old: bytes) -> bytes:
    """Return a cache file with the intact part of a damaged one; any error if nothing can be read."""
    with h5py.File(io.BytesIO(old), "r") as file:
        must(hdf5_store.by_cache(file), "file", "written by a cache", Words("another"))
        try:
            tables = {name: table for name, table in read_tables(file).items() if table.intact}
        except (OSError, KeyError, RuntimeError, ValueError):
            tables = {}  # evaluations cost hours, tables nothing
        return hdf5_store.build_image(_runs(file), tables)


def _runs(file: h5py.File) -> list[RunsTable]:
    """Return the evaluations that can be read, each problem separately."""
    group = file[hdf5_store.EVALUATIONS]
    found = []
    for name in group:
        with contextlib.suppress(OSError, KeyError, RuntimeError, ValueError, TypeError):
            found.append(hdf5_store.read_runs(group[name])[0])
    must(bool(found) or not len(group), "evaluations", "readable", Words("none"))
    return found


if __name__ == "__main__":
    sys.stdout.buffer.write(_rebuild(sys.stdin.buffer.read()))
