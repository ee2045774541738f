"""Locks, appends and whole-file replacement that keep files intact if the process is killed or the disk is
full."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

from tisim.errors import InputError, RunError
from tisim.files.regular_file import file_status, open_descriptor

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]

_held: set[int] = set()
"""Handles of the locks that this process holds."""


def _after_fork() -> None:
    """Close the parent's locks in a forked child, which would otherwise hold them as long as it lives."""
    while _held:
        os.close(_held.pop())


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)

LOCK_TIMEOUT = 60.0
"""Default timeout in s, longer than any working process holds a lock; a suspended process may hold it for
ever."""


@contextlib.contextmanager
def locked(path: Path, *, exclusive: bool, timeout: float | None = None) -> Iterator[int]:
    """Hold the advisory lock of a lock file, among processes and threads; it is released if the holder is
    killed.

    timeout : time to wait for another holder, s; LOCK_TIMEOUT unless given.

    Yields a handle of the file. For shared locks, if there is no lock file and none can be created, the
    handle is of the folder. A lock file is never removed: otherwise two processes could lock two different
    files. Raise InputError if the lock cannot be acquired, RunError if another process holds it longer than
    the timeout.
    """
    if fcntl is None:
        raise InputError("the system must have POSIX file locks (Linux, macOS); received one without fcntl")
    handle = open_descriptor(path, os.O_RDWR | os.O_CREAT) if exclusive else _open_for_reading(path)
    _held.add(handle)
    process = os.getpid()
    try:
        kind = fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH
        _wait_for_lock(handle, path, kind, LOCK_TIMEOUT if timeout is None else timeout)
        yield handle
    finally:
        # A child forked in the meantime, which also leaves this context, has closed the handle already.
        if process == os.getpid():
            _held.discard(handle)
            os.close(handle)


def _open_for_reading(path: Path) -> int:
    """Return a handle for a shared lock: of the lock file, which may belong to another user, or of its
    folder."""
    try:
        return open_descriptor(path, os.O_RDONLY)
    except FileNotFoundError:
        pass
    try:
        return open_descriptor(path, os.O_RDONLY | os.O_CREAT)
    except InputError as error:
        try:
            return os.open(path.parent, os.O_RDONLY | os.O_CLOEXEC)
        except OSError:
            raise error from None


def _wait_for_lock(handle: int, path: Path, kind: int, timeout: float) -> None:
    deadline = time.monotonic() + timeout
    while True:
        try:
            return fcntl.flock(handle, kind | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise RunError(f"{path} has been locked by another process for {timeout:g} s") from None
            time.sleep(0.002)
        except OSError as error:
            raise InputError(
                f"{path} must be on a file system with file locks; received {error.strerror}"
            ) from None


def append_at(path: Path, end: int, data: bytes) -> int:
    """Cut the file at byte ``end``, write data there and flush it to the disk; return the new end.

    If the disk is full, the file is cut at ``end`` again and RunError raised: earlier content is intact.
    Raise InputError if path exists and is not a regular file.
    """
    try:
        handle = open_descriptor(path, os.O_RDWR | os.O_CREAT)
        try:
            if os.fstat(handle).st_size > end:
                os.ftruncate(handle, end)
            try:
                write_at(handle, data, end)
                os.fsync(handle)
            except OSError:
                os.ftruncate(handle, end)
                raise
        finally:
            os.close(handle)
        if end == 0:
            _sync_folder(path)
    except OSError as error:
        raise _write_error(path, error) from error
    return end + len(data)


def replace_file(path: Path, data: bytes) -> None:
    """Replace the content of path atomically: at every instant path is either the old or the new file,
    complete.

    Writers of one path take turns: all use one name for the unfinished file, and reuse a file left by a
    killed writer. Raise RunError if the disk is full; path is then the old file. Raise InputError if the name
    of the unfinished file is taken by something other than a regular file. If path is a link, the link itself
    is replaced, not its target.
    """
    new = path.with_name(temporary_name(path.name))
    try:
        while True:
            with locked(new, exclusive=True) as handle:
                # The previous holder may have renamed it to path; then this lock is on that file.
                if _refers_to(new, handle):
                    _write_and_rename(handle, new, path, data)
                    break
        _sync_folder(path)
    except OSError as error:
        raise _write_error(path, error) from error


def temporary_name(name: str) -> str:
    """Return the name of a file while it is being written."""
    return f"{name}.new"


@contextlib.contextmanager
def replacing(path: Path, new: Path) -> Iterator[None]:
    """Let the caller write ``new``, which is empty at first; at the end rename it to path.

    Raise RunError if the disk is full; path is then the old file, and no unfinished file is left. Raise
    InputError if ``new`` exists and is not a regular file.
    """
    try:
        _create_empty(new)
        try:
            yield
            new.replace(path)
        finally:
            new.unlink(missing_ok=True)
    except OSError as error:
        raise _write_error(path, error) from error


def _create_empty(path: Path) -> None:
    """Create an empty file to be opened by name, replacing one left by a killed process.

    The old one is removed first: it may be a hard or symbolic link, and data would then be written to another
    file.
    """
    if file_status(path) is not None:
        path.unlink()
    os.close(open_descriptor(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL))


def _refers_to(path: Path, handle: int) -> bool:
    try:
        return os.path.samestat(path.lstat(), os.fstat(handle))
    except FileNotFoundError:
        return False


def _write_and_rename(handle: int, new: Path, path: Path, data: bytes) -> None:
    """Write data to the file, flush it to the disk and rename it to path; remove it if that fails."""
    try:
        os.ftruncate(handle, 0)
        write_at(handle, data, 0)
        os.fsync(handle)
        new.replace(path)
    except OSError:
        new.unlink(missing_ok=True)
        raise


def write_at(handle: int, data: bytes, offset: int) -> None:
    """Write all data into an open file at a byte offset; OSError if there is no space."""
    view = memoryview(data)
    while view:
        count = os.pwrite(handle, view, offset)
        view, offset = view[count:], offset + count


def _sync_folder(path: Path) -> None:
    """Flush the folder of a file to the disk, which makes a new file name durable."""
    handle = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _write_error(path: Path, error: OSError) -> RunError:
    return RunError(
        f"{path} could not be written: {error.strerror or error}; everything stored before is intact"
    )
