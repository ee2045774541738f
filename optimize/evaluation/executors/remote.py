"""Scenes to results in other processes: cut into units of work, sent, waited for, sent again if lost."""

from __future__ import annotations

import concurrent.futures as cf
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

from optimize.evaluation.executors import handshake
from optimize.evaluation.executors.worker import Answer, Wanted
from tisim import Result, RunError, Scene

UNITS = 2
"""Units of work per worker and call. More even out runs of different length; fewer are larger, and a batch
of worlds is the faster per world the larger it is."""
LOOK_S = 0.1
"""Time between looks at progress while nothing comes, seconds."""
TRIES = 3
"""Workers that a unit of work may cost before the search gives up."""


class Lost(Exception):
    """The worker is gone: this unit of work will not come back."""


class Pool(Protocol):
    """Workers. workers : how many there are now."""

    @property
    def workers(self) -> int: ...

    def submit(self, scenes: Sequence[Scene], wanted: Wanted) -> cf.Future[Answer]:
        """Have a worker run optimize.evaluation.executors.worker.run on them."""
        ...

    def outcome(self, future: cf.Future[Answer]) -> Answer:
        """The answer of a finished future. Lost when its worker is gone and it must be sent again, RunError
        when that would be no use.
        """
        ...

    def look(self) -> None:
        """Called every LOOK_S while an answer is waited for; RunError when none is to be hoped for."""
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

    def __init__(self, pool: Pool, wanted: Wanted) -> None:
        self.pool, self.wanted = pool, wanted
        self.settings: dict[str, Any] = dict(wanted.settings)

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as units of work end.

        RunError when workers are lost again and again, InputError when one is of another program.
        """
        waiting: dict[cf.Future[Answer], tuple[list[int], int]] = {}

        def send(unit: list[int], lost: int) -> None:
            waiting[self.pool.submit([scenes[k] for k in unit], self.wanted)] = unit, lost

        for unit in units(scenes, self.pool.workers):
            send(unit, 0)
        done = 0
        while waiting:
            finished, _ = cf.wait(waiting, LOOK_S, cf.FIRST_COMPLETED)
            for future in finished:
                unit, lost = waiting.pop(future)
                try:
                    results = self._results(self.pool.outcome(future))
                except Lost as gone:
                    if lost + 1 == TRIES:
                        raise RunError(
                            f"{gone}; it was the worker number {TRIES} to be lost with the same work. "
                            "What had finished is kept"
                        ) from gone
                    send(unit, lost + 1)
                    continue
                done += len(unit)
                yield from zip(unit, results, strict=True)
            self.pool.look()
            if progress is not None:
                progress(done / len(scenes))

    def _results(self, answer: Answer) -> list[Result]:
        """What a worker has found. Its error if it failed, InputError if it is of another program."""
        ours = handshake.program() if answer.error else self.wanted.made_by
        handshake.agree(ours, answer.made_by, answer.worker)
        if answer.error:
            raise answer.error
        return answer.results

    def close(self) -> None:
        """Let the workers go; what they are still at is given up."""
        self.pool.stop()


def units(scenes: Sequence[Scene], workers: int) -> list[list[int]]:
    """Indices of the scenes of each unit of work: scenes of one structure, which run side by side."""
    groups: dict[Any, list[int]] = {}
    for index, scene in enumerate(scenes):
        groups.setdefault(scene.structure(), []).append(index)
    size = max(1, -(-len(scenes) // (UNITS * max(1, workers))))
    return [group[k : k + size] for group in groups.values() for k in range(0, len(group), size)]
