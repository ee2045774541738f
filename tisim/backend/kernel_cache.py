"""The compiled kernels that Taichi keeps on disk for the next process.

Taichi 1.7.4 and Quadrants 1.3.3 read them with the first that they compile, and write them when they stop: at
the end of a process, not when it is killed. Meanwhile they lock them by a file. Another process waits a
quarter of a second for it, then warns, and compiles all or keeps nothing; a process that is killed meanwhile
leaves the file behind. Processes of tisim wait for each other here instead.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path

from tisim.backend.taichi import BACKEND, ti
from tisim.errors import InputError, RunError
from tisim.files.atomic import locked
from tisim.streams import say

STALE = 60.0
"""This time (s) is longer than any process holds a lock."""
LOCKS = {
    "taichi": ("TI_OFFLINE_CACHE_FILE_PATH", "ticache.lock"),
    "quadrants": ("QD_OFFLINE_CACHE_FILE_PATH", "kernel_compilation_manager/qdcache.lock"),
}
"""These are, for each package, the variable that names another folder for its kernels, and the lock in it."""
QUEUE = "tisim.lock"
"""This is the file that processes of tisim queue at, in the same folder: the system frees it when one
dies."""


def lock() -> Path:
    """Return the path of Taichi's lock, which is there while a process holds it."""
    variable, name = LOCKS[BACKEND]
    return Path(os.environ.get(variable) or ti.lang.impl.default_cfg().offline_cache_file_path) / name


def options() -> dict[str, str | bool]:
    """Return the options of the compiler that name the folder for kernels; none where that is its own one.

    The compiler stops where it may not enter its folder. A process that may not gets a temporary one, which
    is removed when the process ends, and keeps no kernels where it may not have that either.
    """
    folder = lock().parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return {}
    except OSError as failure:
        return _without(folder, failure.strerror or str(failure))


@cache
def _without(folder: Path, why: str) -> dict[str, str | bool]:
    """Return the options of a process that may not use its folder for kernels, and say so."""
    say(
        f"compiled kernels are not kept for the next process: {folder} cannot be written ({why}); "
        "set HOME or XDG_CACHE_HOME to a folder that can"
    )
    # The compiler warns of a variable whose option is given.
    os.environ.pop(LOCKS[BACKEND][0], None)
    try:
        return {"offline_cache_file_path": _temporary().name}
    except OSError:
        return {"offline_cache": False}


@cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    """Return a folder that is removed when this process ends, but not when one forked from it does."""
    folder = tempfile.TemporaryDirectory(prefix="tisim-kernels-")
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=folder._finalizer.detach)  # type: ignore[attr-defined]
    return folder


def unlock() -> None:
    """Remove a lock that has been left behind. No error where that is not allowed: kernels are compiled."""
    with suppress(OSError):
        if time.time() - lock().stat().st_mtime > STALE:
            lock().unlink()


@contextmanager
def exclusive_access() -> Iterator[None]:
    """Keep all other processes of tisim from reading or writing the kernels on disk, for as long as this
    lasts.

    Where the folder cannot be written, or the system has no locks, there is no waiting.
    """
    with ExitStack() as stack:
        with suppress(OSError, InputError, RunError):
            lock().parent.mkdir(parents=True, exist_ok=True)
            stack.enter_context(locked(lock().with_name(QUEUE), exclusive=True))
        unlock()
        yield
