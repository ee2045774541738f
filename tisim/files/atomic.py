"""Locks, appends and whole-file replacement leave files whole after a kill at any instant or a full disk."""

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
"""The handles of the locks that this process holds."""


def _after_fork() -> None:
    """Close the locks of the parent in a child, which would hold them for as long as it lives."""
    while _held:
        os.close(_held.pop())


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)

LOCK_TIMEOUT = 60.0
"""This time, in s, is longer than any process at work holds a lock; one that is stopped holds it for good."""


@contextlib.contextmanager
def locked(path: Path, *, exclusive: bool, timeout: float | None = None) -> Iterator[int]:
    """Hold the advisory lock of a lock file, among processes and threads; a killed holder lets go of it.

    timeout : s, to wait for another holder; LOCK_TIMEOUT unless given.
    It yields a handle of the file; of its folder, to a reader where no lock file is and none can be made.
    A lock file stays behind on purpose: removing it would let two processes lock two different files.
    Raise InputError where it cannot be had, RunError when another process holds it for longer.
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
        # A child that was forked meanwhile, and leaves by this way, has closed it already.
        if process == os.getpid():
            _held.discard(handle)
            os.close(handle)


def _open_for_reading(path: Path) -> int:
    """Return a handle to lock for reading: of the lock file, which may be another user's."""
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
            raise InputError(f"{path} must be where files can be locked; received {error.strerror}") from None


def append_at(path: Path, end: int, data: bytes) -> int:
    """Cut the file at byte end, write data there and flush it to the disk; return the new end.

    If the disk is full, the file is cut at end again and RunError raised: what was there before is whole.
    Raise InputError when something that is no file is in its place.
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
    """Put data in the place of path so that path is, at every instant, the old file or a new one, whole.

    Writers of one path take turns: one name serves for the unfinished file, and a killed writer's is reused.
    Raise RunError if the disk is full; path is then the old file. Raise InputError when something that is no
    file has the unfinished one's name; a link in the place of path is replaced itself, not what it points to.
    """
    new = path.with_name(temporary_name(path.name))
    try:
        while True:
            with locked(new, exclusive=True) as handle:
                # Whoever had it before may have put it in its place; then that is the file locked here.
                if _refers_to(new, handle):
                    _write_and_rename(handle, new, path, data)
                    break
        _sync_folder(path)
    except OSError as error:
        raise _write_error(path, error) from error


def temporary_name(name: str) -> str:
    """Return what a file of this name is called while it is written."""
    return f"{name}.new"


@contextlib.contextmanager
def replacing(path: Path, new: Path) -> Iterator[None]:
    """Let the caller write ``new``, an empty file at first; at the end put it in the place of path.

    Raise RunError if the disk is full; path is then the old file, and nothing unfinished is left. Raise
    InputError when something that is no file is in the place of ``new``.
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
    """Make an empty file for those who write by name, in place of one that a killed process has left.

    The old one may be a hard link or a symbolic one: what is written would go to what else has its name.
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
    """Make data all that is in the file, on the disk, and put it in its place; take it away if that fails."""
    try:
        os.ftruncate(handle, 0)
        write_at(handle, data, 0)
        os.fsync(handle)
        new.replace(path)
    except OSError:
        new.unlink(missing_ok=True)
        raise


def write_at(handle: int, data: bytes, offset: int) -> None:
    """Write all of data into an open file from a byte on; OSError when there is no room for it."""
    view = memoryview(data)
    while view:
        count = os.pwrite(handle, view, offset)
        view, offset = view[count:], offset + count


def _sync_folder(path: Path) -> None:
    """Flush the folder of a file to the disk: a new name is on the disk only when its folder is."""
    handle = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _write_error(path: Path, error: OSError) -> RunError:
    return RunError(
        f"{path} could not be written: {error.strerror or error}; everything stored before is intact"
    )
