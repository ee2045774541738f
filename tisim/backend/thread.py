"""The one thread in which Taichi runs, whoever calls.

Taichi belongs to the thread that has started it: another cannot make fields, and once another has compiled
a kernel, the first cannot destroy fields any more. Starting it also makes the thread, and all that this one
starts, take subnormal numbers (below 2.3e-308 in f64) for 0. So Taichi has a thread of its own. Whoever
calls keeps the arithmetic of IEEE 754, threads that call at once take turns, and Ctrl-C reaches the caller
while a kernel runs; the kernel then ends by itself, before anything that is asked for later begins.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_here = threading.local()


def _begin() -> None:
    _here.is_it = True


_thread = ThreadPoolExecutor(1, "taichi", _begin)


def in_taichi_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that runs in Taichi's thread, and returns or raises in the caller's what it does
    there.

    Whatever makes, fills, reads or destroys fields, or calls a kernel, must be in such a function.
    """

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if getattr(_here, "is_it", False):
            return function(*args, **kwargs)
        future = _thread.submit(function, *args, **kwargs)
        try:
            return future.result()
        finally:
            # Where the wait was broken off: what has not begun does not begin.
            future.cancel()

    return call
