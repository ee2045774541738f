"""Workers that are processes on this machine."""

from __future__ import annotations

import concurrent.futures as cf
import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Iterator, Sequence
from multiprocessing import resource_tracker

from tisim.optimize.evaluation.executors import worker
from tisim.optimize.evaluation.executors.remote import Lost
from tisim.optimize.evaluation.executors.worker import Answer, WorkerSettings

from tisim import RunError, Scene
from tisim.backend import runtime

LEAVE_S = 10.0
"""A worker without work has so long to end by itself, s."""


class Processes:
    """So many processes, started (spawned: a fork would not survive Taichi) as there is work for them.

    Each has a connection of its own, and a thread here that waits for its answer: one that dies is noticed at
    once, and takes with it the unit of work that it was at and nothing else. (Those of concurrent.futures
    share queues and their locks, and one that is killed may leave them locked, or a message cut short.)
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._threads = cf.ThreadPoolExecutor(workers)
        self._crew: set[_Worker] = set()
        self._idle: list[_Worker] = []
        self._changing = threading.Lock()
        self._stopped = False

    def submit(self, scenes: Sequence[Scene], worker_settings: WorkerSettings) -> cf.Future[Answer]:
        return self._threads.submit(self._ask, scenes, worker_settings)

    def outcome(self, future: cf.Future[Answer]) -> Answer:
        return future.result()

    def check_workers(self) -> None:
        """A worker that has ended is noticed by the thread that waits for it."""

    def stop(self) -> None:
        """Let the idle ones end in order, and kill those at work."""
        with self._changing:
            self._stopped = True
            for busy in self._crew.difference(self._idle):
                busy.process.kill()
        self._threads.shutdown(wait=True, cancel_futures=True)
        for one in self._crew:
            one.connection.close()
        for one in self._crew:
            one.process.join(LEAVE_S)
            one.process.kill()
            one.process.join()

    def _ask(self, scenes: Sequence[Scene], worker_settings: WorkerSettings) -> Answer:
        question = worker.pack_scenes(scenes)
        with self._changing:
            if self._stopped:
                raise Lost("workers have been stopped")
            member = self._idle.pop() if self._idle else _Worker(max(1, runtime.cores() // self.workers))
            self._crew.add(member)
        try:
            answer = member.answer(question, worker_settings)
        except (EOFError, OSError):
            member.process.join()
            self._crew.remove(member)
            raise Lost(f"a worker process has ended with exit code {member.process.exitcode}") from None
        self._idle.append(member)
        return answer


class _Worker:
    """A process that serves at the other end of a connection."""

    def __init__(self, share: int) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, end = context.Pipe()
        self.process = context.Process(target=worker.serve, args=(end, share), daemon=True)
        with _children_deaf_to_ctrl_c():
            try:
                self.process.start()
            except OSError as failure:
                raise RunError(f"worker process could not be started: {failure}") from failure
        end.close()  # or it would not be closed when the process ends

    def answer(self, scenes: bytes, worker_settings: WorkerSettings) -> Answer:
        """EOFError or OSError when the process ends before it has answered."""
        self.connection.send((scenes, worker_settings))
        answer: Answer = self.connection.recv()
        return answer


@contextlib.contextmanager
def _children_deaf_to_ctrl_c() -> Iterator[None]:
    """A Ctrl-C reaches all processes of the terminal; this one decides what becomes of its workers.

    Signals that a thread blocks, the processes that it starts block from their first instruction on.
    """
    resource_tracker.ensure_running()  # begun by the first start otherwise, which unblocks the signal again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
