"""Runs scenes in other processes: divides them into units of work, sends them, and resends lost ones."""

from __future__ import annotations

import concurrent.futures as cf
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

from tisim import Result, RunError, Scene
from tisim.engine.shared_room import SharedRooms
from tisim.optimize.evaluation.executors import handshake
from tisim.optimize.evaluation.executors.worker import Answer, WorkerSettings

UNITS = 2
"""Units of work of each worker in a call. More units balance runs of different length; fewer are larger, and
a larger batch of worlds is faster per world."""
POLL_S = 0.1
"""Interval between progress reports and checks of the workers while waiting for results, s."""
MAX_LOST_WORKERS = 3
"""The search gives up after a unit of work has lost this number of workers."""


class Lost(Exception):
    """The worker has died; its unit of work must be sent again."""


class Pool(Protocol):
    """A pool of workers.

    workers : current number of workers.
    """

    @property
    def workers(self) -> int: ...

    def submit(self, scenes: Sequence[Scene], worker_settings: WorkerSettings) -> cf.Future[Answer]:
        """Let a worker run optimize.evaluation.executors.worker.run on these scenes."""
        ...

    def outcome(self, future: cf.Future[Answer]) -> Answer:
        """Return the answer of a finished future. Lost if its worker has died and it must be sent again,
        RunError if sending it again would not help."""
        ...

    def check_workers(self) -> None:
        """Called every POLL_S while waiting for an answer; RunError if none can be expected."""
        ...

    def stop(self) -> None:
        """Stop the workers, whether idle or busy."""
        ...


class Remote:
    """An evaluator (optimize.evaluation.runs.Evaluator) on a pool of workers; its results are bitwise equal
    to the in-process ones.

    Yielded results are final, even if a worker dies later; the rest is run again by another worker. Only this
    process writes the cache, so nothing is counted twice.
    """

    def __init__(self, pool: Pool, worker_settings: WorkerSettings) -> None:
        self.pool, self.worker_settings = pool, worker_settings
        self.settings: dict[str, Any] = dict(worker_settings.settings)

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as units of work end.

        RunError if workers are lost repeatedly, InputError if one runs another program.
        """
        waiting: dict[cf.Future[Answer], tuple[list[int], int]] = {}

        def send(unit: list[int], losses: int) -> None:
            waiting[self.pool.submit([scenes[k] for k in unit], self.worker_settings)] = unit, losses

        for unit in units(scenes, self.pool.workers):
            send(unit, 0)
        finished_scenes = 0
        while waiting:
            finished, _ = cf.wait(waiting, POLL_S, cf.FIRST_COMPLETED)
            for future in finished:
                unit, losses = waiting.pop(future)
                try:
                    results = self._results(self.pool.outcome(future))
                except Lost as error:
                    if losses + 1 == MAX_LOST_WORKERS:
                        raise RunError(
                            f"{error}; it was the worker number {MAX_LOST_WORKERS} to be lost with the same "
                            "work. Finished runs are kept"
                        ) from error
                    send(unit, losses + 1)
                    continue
                finished_scenes += len(unit)
                yield from zip(unit, results, strict=True)
            self.pool.check_workers()
            if progress is not None:
                progress(finished_scenes / len(scenes))

    def _results(self, answer: Answer) -> list[Result]:
        """Return the results in a worker's answer. Raises its error if it failed, InputError if it runs
        another program."""
        ours = handshake.program() if answer.error else self.worker_settings.made_by
        handshake.agree(ours, answer.made_by, answer.worker)
        if answer.error:
            raise answer.error
        return answer.results

    def close(self) -> None:
        """Stop the workers; unfinished work is discarded."""
        self.pool.stop()


def units(scenes: Sequence[Scene], workers: int) -> list[list[int]]:
    """Return the indices of the scenes of each unit of work; its scenes have one structure apart from the
    lengths of lists, so they run side by side."""
    groups: dict[Any, list[int]] = {}
    # Calls of functions in place of scenes have no lists.
    are_scenes = all(isinstance(scene, Scene) for scene in scenes)
    for index, scene in enumerate(SharedRooms().scenes(scenes) if are_scenes else scenes):
        groups.setdefault(scene.structure(), []).append(index)
    size = max(1, -(-len(scenes) // (UNITS * max(1, workers))))
    return [group[k : k + size] for group in groups.values() for k in range(0, len(group), size)]
