"""Scenes to results in other processes: cut into units of work, sent, waited for, sent again if lost."""

from __future__ import annotations

import concurrent.futures as cf
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

from optimize.executors.worker import Wanted
from tisim.errors import RunError
from tisim.result import Result
from tisim.scene import Scene

UNITS = 2
"""Units of work per worker and call. More even out runs of different length; fewer are larger, and a batch
of worlds is the faster per world the larger it is."""
LOOK_S = 0.1
"""Time between looks at progress while nothing comes, seconds."""
TRIES = 3
"""Times that workers may be lost in a row, nothing finished in between, before the search gives up."""


class Lost(Exception):
    """Workers are gone: this unit of work will not come back, nor any other that has not finished."""


class Pool(Protocol):
    """Workers. workers : how many there are now."""

    @property
    def workers(self) -> int: ...

    def submit(self, scenes: Sequence[Scene], wanted: Wanted) -> cf.Future[list[Result]]:
        """Have a worker run optimize.executors.worker.run on them."""
        ...

    def outcome(self, future: cf.Future[list[Result]]) -> list[Result]:
        """Of a finished future; its error as it was raised. Lost when its worker is gone and it must be sent
        again, RunError when that would be no use.
        """
        ...

    def stop(self, at_once: bool) -> None:
        """Let the workers go; at_once: whatever they are doing."""
        ...


class Remote:
    """An evaluator (optimize.runs.Evaluator) on a pool of workers; bit for bit the in-process one's results.

    What has been yielded stands, whatever happens to a worker; what has not is run again by another one. The
    cache is written by this process only, so nothing can be counted twice.
    """

    def __init__(self, pool: Pool, wanted: Wanted) -> None:
        self.pool, self.wanted = pool, wanted
        self.settings: dict[str, Any] = dict(wanted.settings)
        self._waiting: dict[cf.Future[list[Result]], list[int]] = {}

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as units of work end."""
        self._waiting = {}
        done, lost = 0, 0
        to_send = units(scenes, self.pool.workers)
        while to_send or self._waiting:
            for unit in to_send:
                self._waiting[self.pool.submit([scenes[k] for k in unit], self.wanted)] = unit
            to_send = []
            finished, _ = cf.wait(self._waiting, LOOK_S, cf.FIRST_COMPLETED)
            while finished:
                future = finished.pop()
                unit = self._waiting.pop(future)
                try:
                    results = self.pool.outcome(future)
                except Lost as gone:
                    lost += not to_send
                    if lost >= TRIES:
                        rule = f"workers were lost {lost} times in a row, with nothing finished"
                        raise RunError(f"{rule} ({gone})") from gone
                    to_send.append(unit)
                    finished = set(self._waiting)  # what else they had is lost with them, or has finished
                    continue
                done, lost = done + len(unit), 0
                yield from zip(unit, results, strict=True)
            if progress is not None:
                progress(done / len(scenes))

    def close(self) -> None:
        """Let the workers go; what they are still at is given up."""
        self.pool.stop(at_once=bool(self._waiting))


def units(scenes: Sequence[Scene], workers: int) -> list[list[int]]:
    """Indices of the scenes of each unit of work: scenes of one structure, which run side by side."""
    groups: dict[Any, list[int]] = {}
    for index, scene in enumerate(scenes):
        groups.setdefault(scene.structure(), []).append(index)
    size = max(1, -(-len(scenes) // (UNITS * max(1, workers))))
    return [group[k : k + size] for group in groups.values() for k in range(0, len(group), size)]
