"""Files that are files and nothing else: opened without following a link and without waiting.

A link in the place of a file of ours would have us write over what it points to; a fifo would have us wait
for ever. Both are refused, and so is what may not be opened, in words.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from tisim.errors import InputError

_REFUSED = {
    errno.ELOOP: "a symbolic link",
    errno.EMLINK: "a symbolic link",  # what FreeBSD says
    errno.EISDIR: "a folder",
    errno.ENXIO: "a socket or device",
    errno.ENODEV: "a device",
    errno.EACCES: "one without permission",
    errno.EPERM: "one without permission",
    errno.EROFS: "one on a read-only file system",
    errno.ENAMETOOLONG: "a name that is too long",
}
_WRITING = os.O_WRONLY | os.O_RDWR


def opened(path: Path, flags: int) -> int:
    """A handle of the file of this name, for functions of os; flags : of os.open.

    InputError unless it is a regular file that may be opened, and one to be written to has no other name (a
    hard link). Other errors (no such file, a full disk) are those of os.open.
    """
    try:
        handle = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise _refusal(path, error) or error from None
    kind = os.fstat(handle)
    found = _unfit(kind)
    if found is None and flags & _WRITING and kind.st_nlink > 1:
        found = f"one with {kind.st_nlink} names (hard links)"
    if found is not None:
        os.close(handle)
        raise _refused(path, found)
    return handle


def status(path: Path) -> os.stat_result | None:
    """What the system knows of the file of this name, None where there is none; InputError as of opened."""
    try:
        kind = path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise _refusal(path, error) or error from None
    found = _unfit(kind)
    if found is not None:
        raise _refused(path, found)
    return kind


def exists(path: Path) -> bool:
    """Whether there is anything of this name, links followed; InputError where that may not be known."""
    return _followed(path) is not None


def is_folder(path: Path) -> bool:
    """Whether there is a folder of this name, links followed; InputError where that may not be known."""
    kind = _followed(path)
    return kind is not None and stat.S_ISDIR(kind.st_mode)


def _followed(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        why = error.strerror or error
        raise InputError(f"{path} must be in a folder that may be entered; received {why}") from None


def content(path: Path, most: int = -1) -> bytes | None:
    """The bytes of a file, at most so many from its beginning; None where there is none.

    InputError as of opened, and where it cannot be read.
    """
    try:
        with os.fdopen(opened(path, os.O_RDONLY), "rb") as file:
            return file.read(most)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise _refused(path, str(error.strerror or error)) from error


def _unfit(kind: os.stat_result) -> str | None:
    if stat.S_ISREG(kind.st_mode):
        return None
    known = {
        stat.S_IFLNK: "a symbolic link", stat.S_IFDIR: "a folder", stat.S_IFIFO: "a fifo",
        stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device",
    }  # fmt: skip
    return known.get(stat.S_IFMT(kind.st_mode), "something else")


def _refusal(path: Path, error: OSError) -> InputError | None:
    found = _REFUSED.get(error.errno or 0)
    return None if found is None else _refused(path, found)


def _refused(path: Path, found: str) -> InputError:
    return InputError(f"{path} must be a regular file of its own that may be opened; received {found}")
