"""The one thread in which Taichi runs, whoever calls.

Taichi belongs to the thread that has started it: another cannot make fields, and once another has compiled
a kernel, the first cannot destroy fields any more. Starting it also makes the thread, and all that this one
starts, take subnormal numbers (below 2.3e-308 in f64) for 0. So Taichi has a thread of its own. Whoever
calls keeps the arithmetic of IEEE 754, threads that call at once take turns, and Ctrl-C reaches the caller
while a kernel runs; the kernel then ends by itself, before anything that is asked for later begins.

A process that is forked has none of the threads of the one that it comes from. Where this one had been at
work there, Taichi cannot be used in the child: its own threads are gone as well, and its locks may be held by
one of them for ever. Where it had not, the child gets a thread of its own.
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
"""Whether this process, or one that it was forked from, has used the thread."""
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
    """Raise RunError where Taichi had been used in the process that this one was forked from."""
    if _forked:
        raise RunError(
            "tisim has been started in the process that this one was forked from, and cannot run here; "
            "start processes by spawn: multiprocessing.get_context('spawn')"
        )


def in_taichi_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that runs in Taichi's thread, and returns or raises in the caller's what it does
    there. It raises RunError in a process that was forked from one where Taichi had been used.

    Whatever makes, fills, reads or destroys fields, or calls a kernel, must be in such a function.
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
            # Where the wait was broken off: what has not begun does not begin.
            future.cancel()

    return call
