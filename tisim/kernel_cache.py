"""The compiled kernels that Taichi keeps on disk for the next process.

Taichi 1.7.4 and Quadrants 1.3.3 lock them by a file, for the moments in which they read or write the list
of them. A process that is killed meanwhile leaves the file behind: no other uses the kernels again, each
compiles its own, and warns.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

from tisim._taichi import BACKEND, ti

STALE = 60.0
"""s, longer than any process holds a lock."""
LOCKS = {
    "taichi": ("TI_OFFLINE_CACHE_FILE_PATH", "ticache.lock"),
    "quadrants": ("QD_OFFLINE_CACHE_FILE_PATH", "kernel_compilation_manager/qdcache.lock"),
}
"""The variable that names another folder, and the lock in it."""


def lock() -> Path:
    """Where the lock is, when it is held."""
    variable, name = LOCKS[BACKEND]
    return Path(os.environ.get(variable) or ti.lang.impl.default_cfg().offline_cache_file_path) / name


def unlock() -> None:
    """Remove a lock that has been left behind. No error where that is not allowed: kernels are compiled."""
    try:
        if time.time() - lock().stat().st_mtime > STALE:
            lock().unlink()
    except OSError:
        pass
