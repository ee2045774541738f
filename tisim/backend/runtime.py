"""The one place that starts Taichi: device, precision, threads, arithmetic. Nothing starts it at import."""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import io
import os
import sys
import threading
from dataclasses import dataclass
from typing import Any

from tisim.backend import choice, kernel_cache, loops, surroundings
from tisim.backend.taichi import BACKEND, ti
from tisim.backend.thread import forked, in_taichi_thread, require_own_process
from tisim.errors import InputError, RunError, is_whole, must

DEVICES = ("cpu", "cuda", "vulkan")
LEAST_ADDRESS_SPACE = 10**9
"""No kernel compiler starts in an address space of so few bytes."""
PRECISIONS = ("f64", "f32")
ARITHMETICS = ("strict", "fast")
THREADS = 1024
"""Taichi is asked for at most so many threads; it makes them all, whether there are cores for them or not."""


@dataclass(frozen=True)
class Runtime:
    """A runtime says where and how kernels run.

    device : "cpu", "cuda" or "vulkan".
    precision : "f64" or "f32"; the type of every floating-point particle field and parameter.
        Time is f64 whatever the precision.
    threads : CPU threads, >= 1.
    arithmetic : "strict", where the same scene gives the same bits; or "fast", where compilers may regroup
        sums, fuse products with them and take reciprocals and roots by estimates and Newton's method. What
        is not a number, or infinite, is reported in both.
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
        """Return what decides the last bits of a result beside the scene: precision, kind of device and
        arithmetic."""
        return {"precision": self.precision, "device": self.device, "arithmetic": self.arithmetic}

    @property
    def described(self) -> dict[str, str]:
        """Return what a run ran on: the settings, and CPU threads, which change no bit."""
        return {**self.settings, **({"threads": str(self.threads)} if self.device == "cpu" else {})}


turn = threading.RLock()
"""This lock is held by ``tisim.run``, studies of accuracy and searches in this process, each from its start
to its end, and while settings change: calls of several threads take turns, and one that is made from within
another, such as from its progress, goes ahead."""

_current: Runtime | None = None
_generation = 0


def _after_fork() -> None:
    """Let go, in a child, of the turn of a thread of the parent, and never take Taichi's program apart there:
    at the end of the process it would wait for its threads, which the child does not have, for ever."""
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
    """Return the memory that this process may have, bytes: that of this machine, or less where there is a
    limit; where the system does not say, as much as a number of bytes can be."""
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError, AttributeError):
        there = sys.maxsize
    return min(there, surroundings.memory_limit())


def init(
    device: str = "cpu", precision: str = "f64", threads: int = 0, arithmetic: str = "strict"
) -> Runtime:
    """Start Taichi with these settings, or keep it as it is when they have not changed.

    threads : CPU threads; 0 for all cores. arithmetic : "strict" or "fast"; see ``Runtime``.
    Raises InputError when a setting is unknown or the device is absent. A change of settings waits until
    ``tisim.run``, ``tisim.accuracy.study`` and ``tisim.optimize.run`` in other threads have returned. It
    invalidates every Simulation made before; those say so when used. Raises RunError in a process that was
    forked from one where Taichi had been started.
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
        atexit.register(_stop)
    if surroundings.address_space() < LEAST_ADDRESS_SPACE:
        # Where threads get no stacks, Quadrants waits for them without end.
        raise _too_little_memory()
    # Whether it starts or not, what ran before has stopped.
    _current, _generation = None, _generation + 1
    try:
        # Taichi announces the device on standard output, where results go.
        with (
            surroundings.existing_folder(),
            kernel_cache.exclusive_access(),
            contextlib.redirect_stdout(io.StringIO()),
        ):
            ti.init(
                arch=getattr(ti, requested.device),
                default_fp=requested.real,
                cpu_max_num_threads=requested.threads,
                # Its flags for LLVM: sums regrouped and fused, no infinity, no sign of zero. NaN stays NaN.
                fast_math=requested.arithmetic == "fast",
                enable_fallback=False,
                # With it, Quadrants 1.3.3 reads stale flags after nested loops, and Taichi 1.7.4 takes three
                # times as long to compile; LLVM optimises the same code afterwards.
                cfg_optimization=False,
                # A step of many phases is unrolled on purpose, without a warning.
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
    """Do nothing: with the first kernel that it compiles, Taichi reads those on the disk."""


def _stop() -> None:
    """Stop Taichi at the end of the process, which has it write down what it has compiled."""
    if forked():
        return
    with kernel_cache.exclusive_access():
        ti.reset()


def restart() -> None:
    """Start Taichi anew with the same settings: whatever was compiled or stored is gone, and its memory."""
    _start(current())


def current() -> Runtime:
    """Return the running settings; start the defaults (cpu, f64, all cores) on first use; see ``init``."""
    require_own_process()
    return _current or init()


def precision() -> str:
    """Return the precision that runs, or by default will; unlike ``current`` it starts nothing."""
    return _current.precision if _current else Runtime.precision


def generation() -> int:
    """Return the number of starts: compiled objects of an earlier generation must not be touched."""
    return _generation


def backend() -> str:
    """Return name and version of the kernel compiler."""
    return f"{BACKEND} {'.'.join(str(part) for part in ti.__version__[:3])}"
