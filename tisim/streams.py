"""Standard streams that cannot be written (closed, full or replaced) lose text, but do not stop a command."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from typing import Any

STANDARD = ("stdout", "stderr")
"""Names in ``sys`` of the output streams; their file descriptors are 1 and 2."""
_READER_GONE = (errno.EPIPE, errno.EBADF)
"""Errors of a stream without a reader: a closed pipe, as behind ``head``, or a closed descriptor."""


class SafeStream:
    """A stream that passes text to another stream, and drops it if that is missing or cannot be written.

    A character that the other stream cannot encode is written as an escape such as ``\\xb5``.

    failure : the error of the first failed write, after which nothing is written; None before.
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.failure: Exception | None = None if stream is not None else OSError(errno.EBADF, "closed")

    def write(self, text: str) -> int:
        """Write text, and return its number of characters."""
        if not isinstance(text, str):
            raise TypeError(f"a text stream takes str, not {type(text).__name__}")
        if self.failure is None:
            with self._caught():
                try:
                    self._stream.write(text)
                except UnicodeError:
                    encoding = getattr(self._stream, "encoding", None) or "ascii"
                    self._stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write several texts."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flush the other stream."""
        if self.failure is None and hasattr(self._stream, "flush"):
            with self._caught():
                self._stream.flush()

    def isatty(self) -> bool:
        """Return whether the other stream is a terminal."""
        try:
            return bool(self._stream.isatty())
        except (AttributeError, OSError, ValueError):
            return False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @property
    def complaint(self) -> str:
        """Return the reason for lost text; empty if there is no loss, or if the stream has no reader."""
        failure = self.failure
        if failure is None or (isinstance(failure, OSError) and failure.errno in _READER_GONE):
            return ""
        return str(getattr(failure, "strerror", None) or failure)

    @contextlib.contextmanager
    def _caught(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as failure:  # ValueError: a closed stream
            self.failure = failure


def safe(stream: Any) -> SafeStream:
    """Return a stream, which may be None, as a SafeStream."""
    return stream if isinstance(stream, SafeStream) else SafeStream(stream)


def escaped(text: str) -> str:
    """Return text with an escape for each character that is not printable, except ends of lines."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


def say(line: str) -> None:
    """Print a line on standard error, if there is one; control characters are printed as escapes."""
    error = safe(sys.stderr)
    error.write(f"{escaped(line)}\n")
    error.flush()


@contextlib.contextmanager
def safe_standard_streams() -> Iterator[tuple[SafeStream, SafeStream]]:
    """Make standard output and standard error safe within this context; yield both.

    At its end, a descriptor that could not be written is redirected to the null device: otherwise the data
    still buffered by the interpreter would fail again when the process ends.
    """
    before = [getattr(sys, name) for name in STANDARD]
    out, error = (safe(stream) for stream in before)
    sys.stdout, sys.stderr = out, error
    try:
        yield out, error
    finally:
        for name, stream, guard in zip(STANDARD, before, (out, error), strict=True):
            guard.flush()
            if guard.failure is not None and stream is getattr(sys, f"__{name}__"):
                _lead_to_null(1 + STANDARD.index(name))
            setattr(sys, name, stream)


def fill_standard_descriptors() -> None:
    """Open the null device for each standard descriptor that is closed.

    Otherwise the next opened file would get its number, and output of libraries would go into that file.
    """
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            _lead_to_null(descriptor)


def _lead_to_null(descriptor: int) -> None:
    null = os.open(os.devnull, os.O_RDWR)
    if null != descriptor:
        os.dup2(null, descriptor)
        os.close(null)
    else:
        os.set_inheritable(descriptor, True)
