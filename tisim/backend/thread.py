"""All calls of Taichi run in one dedicated thread.

Taichi is bound to the thread that started it. Other threads cannot make fields, and once another thread has
compiled a kernel, the first one cannot destroy fields any more. Starting Taichi also sets this thread, and
all threads that it starts, to treat subnormal numbers (below 2.3e-308 in f64) as 0. Taichi therefore has a
thread of its own. The calling thread keeps IEEE 754 arithmetic, simultaneous calls wait for each other, and
Ctrl-C reaches the caller while a kernel runs; the kernel then completes before any later request begins.

A forked process has none of the threads of its parent. If the parent had used Taichi, the child cannot use
it: Taichi's own threads are missing too, and a missing thread may hold its locks forever. Otherwise the child
gets a dedicated thread of its own.
"""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from tisim.errors import RunError

P = ParamSpec("P")
R = TypeVar("R")

_here = threading.local()


_started = False
"""Whether this process, or a process that it was forked from, has used the thread."""
_forked = False
"""Whether the thread was lost when this process was forked."""


def _begin() -> None:
    global _started
    _here.is_it = _started = True


def _make_thread() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, "taichi", _begin)


_thread = _make_thread()


def _after_fork() -> None:
    global _thread, _forked
    _forked = _started
    _thread = _make_thread()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def forked() -> bool:
    """Return whether Taichi had been used in the process that this one was forked from."""
    return _forked


def require_own_process() -> None:
    """Raise RunError if Taichi had been used in the process that this one was forked from."""
    if _forked:
        raise RunError(
            "tisim has been started in the process that this one was forked from, and cannot run here; "
            "start processes by spawn: multiprocessing.get_context('spawn')"
        )


def in_taichi_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that runs in Taichi's thread, and passes its result or exception to the caller.

    It raises RunError in a process that was forked from one in which Taichi had been used. Every function
    that makes, fills, reads or destroys fields, or calls a kernel, must be wrapped in this way.
    """

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        require_own_process()
        if getattr(_here, "is_it", False):
            return function(*args, **kwargs)
        future = _thread.submit(function, *args, **kwargs)
        try:
            return future.result()
        finally:
            # If the wait was interrupted, a call that has not begun is cancelled.
            future.cancel()

    return call
