"""A lock on an output folder: one command at a time writes files there, and holds the lock while it works.

The lock is on a separate file that is never removed (see tisim.files.atomic.locked), and is released if the
process is killed. Commands that draw or copy results do not take it, so that a run can be viewed while it
continues.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tisim.errors import InputError, RunError
from tisim.files import regular_file
from tisim.files.atomic import locked

LOCK = ".tisim.lock"
AT_WORK_TIMEOUT = 1.0
"""Default timeout in s. It is much longer than a test for another process, which also holds the lock."""


def check(folder: Path, timeout: float = AT_WORK_TIMEOUT) -> None:
    """Raise InputError if another process works in the folder; nothing is changed."""
    if regular_file.file_status(folder / LOCK) is not None:
        with acquire(folder, exclusive=False, timeout=timeout):
            pass


@contextmanager
def acquire(folder: Path, *, exclusive: bool = True, timeout: float = AT_WORK_TIMEOUT) -> Iterator[None]:
    """Hold the lock of an existing folder; raise InputError if another process holds it.

    exclusive : False to share the lock with readers. timeout : time to wait for another process, s.
    """
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(folder / LOCK, exclusive=exclusive, timeout=timeout))
        except RunError:
            raise InputError(
                "output folder must be without a command that is still at work there; "
                f"received {str(folder)!r}, where another process is running"
            ) from None
        yield
