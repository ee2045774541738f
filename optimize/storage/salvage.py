"""What can still be read of a cache file whose structure is damaged, or that another program has written to.

HDF5 may crash on such a file, or never return: it is read in a process of its own, ended after a while. Rows
and tables count when their own checksums fit.
"""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import h5py

from optimize.storage import hdf5_store
from tisim.errors import must
from tisim.files.atomic import locked, replace_file
from tisim.files.checksum import verified
from tisim.files.regular_file import content, file_status

LIMIT = 300.0
"""s, for that process; reading a million rows takes a tenth of it."""


def mend(path: Path, lock: Path) -> None:
    """Put what can be read in the place of the file, and the damaged one beside it as FILE.damaged.

    Nothing happens when the file is whole, or nothing can be read. InputError when FILE.damaged is there.
    """
    old = content(path)
    if old is None or verified(old) is not None:
        return
    made = _salvaged(old)
    if made is None:
        return
    beside = path.with_name(f"{path.name}.damaged")
    with locked(lock, exclusive=True):
        if content(path) == old:
            must(file_status(beside) is None, "place for the damaged file", "free", str(beside))
            replace_file(beside, old)
            replace_file(path, made)


def _salvaged(old: bytes) -> bytes | None:
    command = [sys.executable, "-m", "optimize.storage.salvage"]
    try:
        done = subprocess.run(command, input=old, capture_output=True, timeout=LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return None
    return done.stdout if done.returncode == 0 and verified(done.stdout) is not None else None


def _read(old: bytes) -> bytes:
    """A cache file of what is whole in a damaged one; any error when nothing can be read."""
    with h5py.File(io.BytesIO(old), "r") as file:
        written = file.attrs.get("format") == hdf5_store.EVALUATIONS_FORMAT
        must(written, "file", "written by a cache", "another")
        records, _ = hdf5_store.read_rows(file)
        try:
            bad = hdf5_store.damaged_tables(file)
            tables = {
                name: hdf5_store.read_table(file, name) for name in hdf5_store.tables(file) if name not in bad
            }
        except (OSError, KeyError, RuntimeError, ValueError):
            tables = {}  # evaluations cost hours, tables nothing
    return hdf5_store.image(None, records, tables)


if __name__ == "__main__":
    sys.stdout.buffer.write(_read(sys.stdin.buffer.read()))
