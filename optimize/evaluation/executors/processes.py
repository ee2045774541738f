"""Workers that are processes on this machine."""

from __future__ import annotations

import concurrent.futures as cf
import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Iterator, Sequence
from multiprocessing import resource_tracker

from tisim import RunError, Scene
from tisim.backend import runtime
from tisim.optimize.evaluation.executors import worker
from tisim.optimize.evaluation.executors.remote import Lost
from tisim.optimize.evaluation.executors.worker import Answer, WorkerSettings

LEAVE_S = 10.0
"""Time limit for an idle worker to exit by itself, s."""


class Processes:
    """A fixed number of worker processes, spawned on demand (Taichi would not survive a fork).

    Each worker has its own connection, and a thread in this process that waits for its answer. If a worker
    dies, this is noticed at once, and only its current unit of work is lost. (Processes of concurrent.futures
    share queues and locks; one that is killed may leave them locked, or a message incomplete.)
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
        """Do nothing: the thread that waits for a worker notices its end."""

    def stop(self) -> None:
        """Let idle workers exit normally, and kill the busy ones."""
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
        end.close()  # otherwise it would stay open after the process has ended

    def answer(self, scenes: bytes, worker_settings: WorkerSettings) -> Answer:
        """Return the answer of the process. EOFError or OSError if the process ends before it has
        answered."""
        self.connection.send((scenes, worker_settings))
        answer: Answer = self.connection.recv()
        return answer


@contextlib.contextmanager
def _children_deaf_to_ctrl_c() -> Iterator[None]:
    """Make child processes ignore Ctrl-C, which the terminal sends to all; this process decides when they
    stop.

    A process inherits the blocked signals of the thread that starts it, from its first instruction on.
    """
    resource_tracker.ensure_running()  # otherwise the first start begins it, which unblocks the signal again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
