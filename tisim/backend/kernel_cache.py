"""The cache of compiled kernels that Taichi keeps on disk for later processes.

Taichi 1.7.4 and Quadrants 1.3.3 read it when they compile the first kernel, and write it when they stop: at
the end of a process, but not if it is killed. Meanwhile they lock it by a file. Another process waits a
quarter of a second for the lock, then warns, and compiles everything or stores nothing; a killed process
leaves the file behind. Processes of tisim wait for each other in a queue instead.
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
"""A time (s) longer than any process holds the lock."""
LOCKS = {
    "taichi": ("TI_OFFLINE_CACHE_FILE_PATH", "ticache.lock"),
    "quadrants": ("QD_OFFLINE_CACHE_FILE_PATH", "kernel_compilation_manager/qdcache.lock"),
}
"""For each package, the variable that names another cache folder, and the lock in the folder."""
QUEUE = "tisim.lock"
"""File in the cache folder that processes of tisim lock to queue; the system unlocks it when a process
dies."""


def lock() -> Path:
    """Return the path of Taichi's lock file, which exists while a process holds the lock."""
    variable, name = LOCKS[BACKEND]
    return Path(os.environ.get(variable) or ti.lang.impl.default_cfg().offline_cache_file_path) / name


def options() -> dict[str, str | bool]:
    """Return the compiler options that set the cache folder; none if the default folder can be used.

    The compiler stops if it cannot write to its folder. In that case the process gets a temporary folder that
    is removed at its end. If that cannot be made either, no kernels are stored.
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
    """Return the options of a process that cannot write to its cache folder, and print a notice."""
    say(
        f"compiled kernels are not kept for the next process: {folder} cannot be written ({why}); "
        "set HOME or XDG_CACHE_HOME to a folder that can"
    )
    # The compiler warns if the variable is set and the option is given.
    os.environ.pop(LOCKS[BACKEND][0], None)
    try:
        return {"offline_cache_file_path": _temporary().name}
    except OSError:
        return {"offline_cache": False}


@cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    """Return a temporary folder that is removed when this process ends, but not when a process forked from it
    ends."""
    folder = tempfile.TemporaryDirectory(prefix="tisim-kernels-")
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=folder._finalizer.detach)  # type: ignore[attr-defined]
    return folder


def unlock() -> None:
    """Remove a stale lock. Without the permission nothing happens, and kernels are compiled."""
    with suppress(OSError):
        if time.time() - lock().stat().st_mtime > STALE:
            lock().unlink()


@contextmanager
def exclusive_access() -> Iterator[None]:
    """Keep all other processes of tisim from reading or writing the cache within this context.

    There is no waiting if the folder cannot be written, or if the system has no file locks.
    """
    with ExitStack() as stack:
        with suppress(OSError, InputError, RunError):
            lock().parent.mkdir(parents=True, exist_ok=True)
            stack.enter_context(locked(lock().with_name(QUEUE), exclusive=True))
        unlock()
        yield
