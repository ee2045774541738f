"""The only module that starts Taichi, with device, precision, threads and arithmetic. An import starts
nothing."""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tisim.backend import choice, kernel_cache, loops, surroundings
from tisim.backend.taichi import BACKEND, ti
from tisim.backend.thread import forked, in_taichi_thread, require_own_process
from tisim.errors import InputError, RunError, is_whole, must

DEVICES = ("cpu", "cuda", "vulkan")
LEAST_ADDRESS_SPACE = 10**9
"""With a smaller address space (bytes) no kernel compiler starts."""
PRECISIONS = ("f64", "f32")
ARITHMETICS = ("strict", "fast")
THREADS = 1024
"""Largest number of threads; Taichi creates all of them, even if there are fewer cores."""


@dataclass(frozen=True)
class Runtime:
    """A runtime has the settings for running kernels.

    device : "cpu", "cuda" or "vulkan".
    precision : "f64" or "f32"; the type of every floating-point particle field and parameter. Time is f64 in
    either case.
    threads : CPU threads, >= 1.
    arithmetic : "strict": the same scene gives bitwise equal results. "fast": compilers may regroup sums,
    fuse them with products, and compute reciprocals and roots by estimates and Newton's method. NaN and
    infinite values are reported in both.
    """

    device: str = "cpu"
    precision: str = "f64"
    threads: int = 0
    arithmetic: str = "strict"

    def __post_init__(self) -> None:
        choice.check(BACKEND)
        must(self.device in DEVICES, "device", f"one of {', '.join(DEVICES)}", self.device)
        must(self.precision in PRECISIONS, "precision", f"one of {', '.join(PRECISIONS)}", self.precision)
        kinds = ", ".join(ARITHMETICS)
        must(self.arithmetic in ARITHMETICS, "arithmetic", f"one of {kinds}", self.arithmetic)
        must(
            is_whole(self.threads, 0), "threads", "a whole number, at least 1 (0 for all cores)", self.threads
        )
        must(self.threads <= THREADS, "threads", f"at most {THREADS}", self.threads)

    @property
    def real(self) -> Any:
        """Return the Taichi type of a particle quantity."""
        return ti.f64 if self.precision == "f64" else ti.f32

    @property
    def settings(self) -> dict[str, str]:
        """Return the settings, apart from the scene, that determine the last bits of a result: precision,
        kind of device and arithmetic."""
        return {"precision": self.precision, "device": self.device, "arithmetic": self.arithmetic}

    @property
    def described(self) -> dict[str, str]:
        """Return the settings of a run for its result, with the CPU threads, which do not change any bit."""
        return {**self.settings, **({"threads": str(self.threads)} if self.device == "cpu" else {})}


turn = threading.RLock()
"""Lock held by ``tisim.run``, accuracy studies and searches from start to end, and while settings change.
Calls of several threads wait for each other; a nested call, for example from a progress function, proceeds.
"""
before_stop: list[Callable[[], None]] = []
"""Functions that are called in Taichi's thread before it stops at the end of the process."""

_current: Runtime | None = None
_generation = 0


def _after_fork() -> None:
    """Prepare a forked child process.

    The lock of a thread of the parent is replaced. Taichi's program is never destroyed in the child: at exit
    it would wait forever for threads that the child does not have.
    """
    global turn
    turn = threading.RLock()
    if _current is not None:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(ti.lang.impl.get_runtime().prog))


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def cores() -> int:
    """Return the number of CPU cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def memory() -> int:
    """Return the memory available to this process, bytes: the memory of the machine, or a lower limit.

    If the system does not report it, the largest possible number is returned.
    """
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError, AttributeError):
        there = sys.maxsize
    return min(there, surroundings.memory_limit())


def init(
    device: str = "cpu", precision: str = "f64", threads: int = 0, arithmetic: str = "strict"
) -> Runtime:
    """Start Taichi with these settings, or keep it running if they have not changed.

    threads : CPU threads; 0 for all cores. arithmetic : "strict" or "fast"; see ``Runtime``.

    Raises InputError if a setting is unknown or the device is absent. A change of settings waits until
    ``tisim.run``, ``tisim.accuracy.study`` and ``tisim.optimize.run`` in other threads have returned. It
    invalidates every Simulation made before; using one of these raises an error. Raises RunError in a process
    that was forked from one in which Taichi had been started.
    """
    require_own_process()
    requested = Runtime(device, precision, threads or cores(), arithmetic)
    if requested == _current:
        return requested
    with turn:
        _start(requested)
    return requested


@in_taichi_thread
def _start(requested: Runtime) -> None:
    global _current, _generation
    if not _generation:
        # At the time of atexit the thread has ended, and on CUDA no other thread can stop the compiler. The
        # function used here is private to Python 3.11-3.13; concurrent.futures ends its threads by it.
        threading._register_atexit(_stop)  # type: ignore[attr-defined]
    if surroundings.address_space() < LEAST_ADDRESS_SPACE:
        # If threads cannot get their stacks, Quadrants waits for them forever.
        raise _too_little_memory()
    # The previous Taichi has stopped, even if the start fails.
    _current, _generation = None, _generation + 1
    try:
        # Taichi prints the device to standard output, which is used for results.
        with (
            surroundings.existing_folder(),
            kernel_cache.exclusive_access(),
            contextlib.redirect_stdout(io.StringIO()),
        ):
            ti.init(
                arch=getattr(ti, requested.device),
                default_fp=requested.real,
                cpu_max_num_threads=requested.threads,
                # LLVM flags: sums are regrouped and fused, infinities and the sign of zero ignored. NaN stays
                # NaN.
                fast_math=requested.arithmetic == "fast",
                enable_fallback=False,
                # With this pass, Quadrants 1.3.3 reads stale flags after nested loops, and Taichi 1.7.4 takes
                # three times as long to compile; LLVM optimises the same code afterwards.
                cfg_optimization=False,
                # On CUDA, Quadrants 1.3.3 takes the first component of a vector for constant in kernels that
                # write it: the kick after a sum of forces in the same kernel had the force along x of before.
                detect_read_only=False,
                # A step of many phases is unrolled on purpose; this avoids the warning.
                unrolling_limit=0,
                **kernel_cache.options(),
            )
            _compile_first()
    except RuntimeError as failure:
        if "memory" in str(failure):
            raise _too_little_memory() from failure
        raise InputError(
            f"device must be present on this machine; received {requested.device!r} ({failure})"
        ) from failure
    if requested.device == "vulkan":
        rule = "one whose driver ends loops where it should (Mesa's software device: from version 25 on)"
        must(loops.end_where_they_should(), "device", rule, requested.device)
    if requested.device == "cpu":
        choice.advise(kernel_cache.lock().parent)
    _current = requested


def _too_little_memory() -> RunError:
    return RunError(
        f"memory must be enough to start {BACKEND}; received no more than {memory() / 1e9:.3g} GB "
        "(ulimit -v, or a limit of the container or batch system)"
    )


@ti.kernel
def _compile_first():
    """Do nothing; when Taichi compiles its first kernel, it reads the cache on disk."""


def _stop() -> None:
    """Stop Taichi at the end of the process, so that it writes the compiled kernels to disk."""
    if not forked():
        _reset()


@in_taichi_thread
def _reset() -> None:
    for release in before_stop:
        release()
    with kernel_cache.exclusive_access():
        ti.reset()


def restart() -> None:
    """Restart Taichi with the same settings; all compiled kernels, fields and memory are freed."""
    _start(current())


def current() -> Runtime:
    """Return the current settings; start Taichi with the defaults (cpu, f64, all cores) on first use; see
    ``init``."""
    require_own_process()
    return _current or init()


def precision() -> str:
    """Return the current precision, or the default one; unlike ``current`` this starts nothing."""
    return _current.precision if _current else Runtime.precision


def generation() -> int:
    """Return the number of starts of Taichi; compiled objects of an earlier start must not be used."""
    return _generation


def backend() -> str:
    """Return the name and version of the kernel compiler."""
    return f"{BACKEND} {'.'.join(str(part) for part in ti.__version__[:3])}"
