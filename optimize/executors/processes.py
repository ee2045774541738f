"""Workers that are processes on this machine."""

from __future__ import annotations

import concurrent.futures as cf
import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool

from optimize.executors import worker
from optimize.executors.remote import Lost
from optimize.executors.worker import Wanted
from tisim import runtime
from tisim.result import Result
from tisim.scene import Scene


class Processes:
    """So many processes, started (spawned: a fork would not survive Taichi) with the first work."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._pool: cf.ProcessPoolExecutor | None = None
        self._broken = False
        self._children: set[multiprocessing.process.BaseProcess] = set()

    def submit(self, scenes: Sequence[Scene], wanted: Wanted) -> cf.Future[list[Result]]:
        if self._pool is None or self._broken:
            self.stop(at_once=True)
            context = multiprocessing.get_context("spawn")
            self._pool, self._broken = cf.ProcessPoolExecutor(self.workers, context), False
        share = max(1, runtime.cores() // self.workers)
        before = set(multiprocessing.active_children())
        with _children_deaf_to_ctrl_c():
            future = self._pool.submit(worker.run, scenes, wanted, share)
        self._children |= set(multiprocessing.active_children()) - before
        return future

    def outcome(self, future: cf.Future[list[Result]]) -> list[Result]:
        try:
            return future.result()
        except BrokenProcessPool as broken:
            self._broken = True
            raise Lost(str(broken)) from broken

    def stop(self, at_once: bool) -> None:
        if self._pool is None:
            return
        if at_once:
            for child in self._children:
                child.terminate()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._pool = None
        self._children.clear()


@contextlib.contextmanager
def _children_deaf_to_ctrl_c() -> Iterator[None]:
    """A Ctrl-C reaches all processes of the terminal; this one decides what becomes of its workers.

    What a process ignores, the processes that it starts ignore from their first instruction on.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
