"""Opening of regular files without following links and without blocking.

A link in place of an output file would redirect writes to its target, and a fifo would block for ever. Both
are refused, as are files that may not be opened, with a message.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from tisim.errors import InputError, printable

_REFUSALS = {
    errno.ELOOP: "a symbolic link",
    errno.EMLINK: "a symbolic link",  # FreeBSD's error for a link
    errno.EISDIR: "a folder",
    errno.ENXIO: "a socket or device",
    errno.ENODEV: "a device",
    errno.EACCES: "one without permission",
    errno.EPERM: "one without permission",
    errno.EROFS: "one on a read-only file system",
    errno.ENAMETOOLONG: "a name that is too long",
}
_WRITING = os.O_WRONLY | os.O_RDWR


def open_descriptor(path: Path, flags: int) -> int:
    """Return a file descriptor of the file of this name. flags : flags of os.open.

    Raise InputError unless it is a regular file that may be opened; a file opened for writing must not have
    another name (hard link). Other errors (no such file, a full disk) are raised as by os.open.
    """
    _check_name(path)
    try:
        descriptor = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise _refusal(path, error) or error from None
    info = os.fstat(descriptor)
    fault = _irregular_kind(info)
    if fault is None and flags & _WRITING and info.st_nlink > 1:
        fault = f"one with {info.st_nlink} names (hard links)"
    if fault is not None:
        os.close(descriptor)
        raise _not_regular(path, fault)
    return descriptor


def file_status(path: Path) -> os.stat_result | None:
    """Return the os.stat_result of the file of this name, None if there is none.

    Raise InputError unless it is a regular file; see ``open_descriptor``.
    """
    _check_name(path)
    try:
        info = path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise _refusal(path, error) or error from None
    fault = _irregular_kind(info)
    if fault is not None:
        raise _not_regular(path, fault)
    return info


def exists(path: Path) -> bool:
    """Return whether anything of this name exists, following links; raise InputError if access is denied."""
    return _stat_following_links(path) is not None


def irregular(path: Path) -> str | None:
    """Return the kind of a file that is not regular, as text, following links; None if it is regular or
    missing."""
    info = _stat_following_links(path)
    return None if info is None else _irregular_kind(info)


def is_folder(path: Path) -> bool:
    """Return whether a folder of this name exists, following links; raise InputError if access is denied."""
    info = _stat_following_links(path)
    return info is not None and stat.S_ISDIR(info.st_mode)


def target(path: Path) -> Path:
    """Return the path with all links resolved; raise InputError if it is not a valid file name."""
    _check_name(path)
    return Path(os.path.realpath(path))


def _check_name(path: Path) -> None:
    """Raise InputError for a name with a NUL, which Python cannot pass to system calls."""
    if "\0" in str(path):
        raise _not_regular(path, "a name with a NUL")


def _stat_following_links(path: Path) -> os.stat_result | None:
    _check_name(path)
    try:
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        if error.errno in (errno.ENAMETOOLONG, errno.ELOOP):
            raise _refusal(path, error) or error from None
        why = error.strerror or error
        raise InputError(f"{path} must be in a folder that may be entered; received {why}") from None


def content(path: Path, most: int = -1) -> bytes | None:
    """Return the bytes of a file, at most ``most`` from its beginning; None if there is no file.

    Raise InputError unless it is a regular file that can be read; see ``open_descriptor``.
    """
    try:
        with os.fdopen(open_descriptor(path, os.O_RDONLY), "rb") as file:
            return file.read(most)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise _not_regular(path, str(error.strerror or error)) from error


def _irregular_kind(info: os.stat_result) -> str | None:
    if stat.S_ISREG(info.st_mode):
        return None
    kinds = {
        stat.S_IFLNK: "a symbolic link", stat.S_IFDIR: "a folder", stat.S_IFIFO: "a fifo",
        stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device",
    }  # fmt: skip
    return kinds.get(stat.S_IFMT(info.st_mode), "something else")


def _refusal(path: Path, error: OSError) -> InputError | None:
    received = _REFUSALS.get(error.errno or 0)
    return None if received is None else _not_regular(path, received)


def _not_regular(path: Path, received: str) -> InputError:
    return InputError(
        f"{printable(str(path))} must be a regular file that can be opened; received {received}"
    )
