"""One command at a time makes files in a folder: it holds a lock for as long as it is at work.

The lock is of a file of its own, which stays (see tisim.files.atomic.locked); a killed process lets go of it.
Commands that draw or copy what is in a folder do without, so that a run can be looked at while it goes on.
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
"""This time, in s, is far longer than it takes to see whether a folder is in use, for which the lock is held
as well."""


def check(folder: Path, timeout: float = AT_WORK_TIMEOUT) -> None:
    """Raise InputError where another process is at work in the folder; touch nothing."""
    if regular_file.file_status(folder / LOCK) is not None:
        with acquire(folder, exclusive=False, timeout=timeout):
            pass


@contextmanager
def acquire(folder: Path, *, exclusive: bool = True, timeout: float = AT_WORK_TIMEOUT) -> Iterator[None]:
    """Hold the lock of a folder, which exists; raise InputError where another process holds it.

    exclusive : False to share it with those who only read. timeout : to wait for the other one, s.
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
