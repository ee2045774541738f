"""Scenes to results in other processes: cut into units of work, sent, waited for, sent again if lost."""

from __future__ import annotations

import concurrent.futures as cf
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

from tisim.optimize.evaluation.executors import handshake
from tisim.optimize.evaluation.executors.worker import Answer, WorkerSettings

from tisim import Result, RunError, Scene

UNITS = 2
"""Each worker gets so many units of work in a call. More even out runs of different length; fewer are larger,
and a batch of worlds is the faster per world the larger it is."""
POLL_S = 0.1
"""Progress is reported and workers are checked after so long while nothing comes, s."""
MAX_LOST_WORKERS = 3
"""The search gives up once a unit of work has cost so many workers."""


class Lost(Exception):
    """The worker is gone: this unit of work will not come back."""


class Pool(Protocol):
    """Workers. workers : how many there are now."""

    @property
    def workers(self) -> int: ...

    def submit(self, scenes: Sequence[Scene], worker_settings: WorkerSettings) -> cf.Future[Answer]:
        """Have a worker run optimize.evaluation.executors.worker.run on them."""
        ...

    def outcome(self, future: cf.Future[Answer]) -> Answer:
        """Return the answer of a finished future. Lost when its worker is gone and it must be sent again,
        RunError when that would be no use.
        """
        ...

    def check_workers(self) -> None:
        """Called every POLL_S while an answer is waited for; RunError when none is to be hoped for."""
        ...

    def stop(self) -> None:
        """Let the workers go, whatever they are doing."""
        ...


class Remote:
    """An evaluator (optimize.evaluation.runs.Evaluator) on a pool of workers; bit for bit
    the in-process one's results.

    What has been yielded stands, whatever happens to a worker; what has not is run again by another one. The
    cache is written by this process only, so nothing can be counted twice.
    """

    def __init__(self, pool: Pool, worker_settings: WorkerSettings) -> None:
        self.pool, self.worker_settings = pool, worker_settings
        self.settings: dict[str, Any] = dict(worker_settings.settings)

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as units of work end.

        RunError when workers are lost again and again, InputError when one is of another program.
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
                            "work. What had finished is kept"
                        ) from error
                    send(unit, losses + 1)
                    continue
                finished_scenes += len(unit)
                yield from zip(unit, results, strict=True)
            self.pool.check_workers()
            if progress is not None:
                progress(finished_scenes / len(scenes))

    def _results(self, answer: Answer) -> list[Result]:
        """Return what a worker has found. Its error if it failed, InputError if it is of another program."""
        ours = handshake.program() if answer.error else self.worker_settings.made_by
        handshake.agree(ours, answer.made_by, answer.worker)
        if answer.error:
            raise answer.error
        return answer.results

    def close(self) -> None:
        """Let the workers go; what they are still at is given up."""
        self.pool.stop()


def units(scenes: Sequence[Scene], workers: int) -> list[list[int]]:
    """Return the indices of the scenes of each unit of work: scenes of one structure, which run side by
    side."""
    groups: dict[Any, list[int]] = {}
    for index, scene in enumerate(scenes):
        groups.setdefault(scene.structure(), []).append(index)
    size = max(1, -(-len(scenes) // (UNITS * max(1, workers))))
    return [group[k : k + size] for group in groups.values() for k in range(0, len(group), size)]
