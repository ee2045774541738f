"""Files that survive a kill at any instant and a full disk: locks, appends and whole-file replacement."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from tisim.errors import InputError, RunError

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]


@contextlib.contextmanager
def locked(path: Path, *, exclusive: bool) -> Iterator[int]:
    """Hold the advisory lock of a lock file, among processes and threads; a killed holder lets go of it.

    Gives a handle of the file. A lock file stays behind on purpose: removing it would let two processes lock
    two different files.
    """
    if fcntl is None:
        raise InputError("the system must have POSIX file locks (Linux, macOS); received one without fcntl")
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH)
        yield handle
    finally:
        os.close(handle)


def append_at(path: Path, end: int, data: bytes) -> int:
    """Cut the file at byte end, write data there and flush it to the disk; return the new end.

    If the disk is full, the file is cut at end again and RunError raised: what was there before is whole.
    """
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        if os.fstat(handle).st_size > end:
            os.ftruncate(handle, end)
        try:
            _write_all(handle, data, end)
            os.fsync(handle)
        except OSError as error:
            os.ftruncate(handle, end)
            raise _full(path, error) from error
    finally:
        os.close(handle)
    if end == 0:
        _sync_folder(path)
    return end + len(data)


def replace_file(path: Path, data: bytes) -> None:
    """Put data in the place of path so that path is, at every instant, the old file or a new one, whole.

    Writers of one path take turns: one name serves for the unfinished file, and a killed writer's is reused.
    RunError if the disk is full; path is then the old file.
    """
    unfinished = path.with_name(path.name + ".new")
    try:
        while True:
            with locked(unfinished, exclusive=True) as handle:
                # Whoever had it before may have put it in its place; then that is the file locked here.
                if _names(unfinished, handle):
                    _finish(handle, unfinished, path, data)
                    break
    except OSError as error:
        raise _full(path, error) from error
    _sync_folder(path)


def _names(path: Path, handle: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(handle))
    except FileNotFoundError:
        return False


def _finish(handle: int, unfinished: Path, path: Path, data: bytes) -> None:
    """Make data all that is in the file, on the disk, and put it in its place; take it away if that fails."""
    try:
        os.ftruncate(handle, 0)
        _write_all(handle, data, 0)
        os.fsync(handle)
        unfinished.replace(path)
    except OSError:
        unfinished.unlink(missing_ok=True)
        raise


def _write_all(handle: int, data: bytes, offset: int) -> None:
    view = memoryview(data)
    while view:
        written = os.pwrite(handle, view, offset)
        view, offset = view[written:], offset + written


def _sync_folder(path: Path) -> None:
    """A new name is on the disk only when its folder is."""
    handle = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _full(path: Path, error: OSError) -> RunError:
    return RunError(
        f"{path} could not be written: {error.strerror or error}; everything stored before is intact"
    )
