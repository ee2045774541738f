"""Many scenes, a batch of worlds at a time, on compiled simulations that are kept for the next ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tisim import runtime
from tisim.errors import InputError, must
from tisim.particles import Arrays
from tisim.result import Result, Status
from tisim.scene import Scene
from tisim.simulation import Simulation
from tisim.trajectory import Trajectory

SLOTS = 300_000
"""Particles of all worlds of a batch together; keeps its memory to some hundred MB."""
KEPT = 8
"""Compiled simulations kept for later calls, each of another structure."""

Progress = Callable[[float], None]


def share(progress: Progress, done: int, parts: int) -> Progress:
    """For one of several parts of equal length, ``done`` of which are over: reports of it as of the whole."""
    return lambda fraction: progress((done + fraction) / parts)


class Batches:
    """Scenes to results. Scenes of one structure (effects, options, domain, stepper) run side by side.

    limit : most worlds of a batch. A world is yielded when it has ended, while others go on, so that whoever
    keeps results loses little when stopped.
    """

    def __init__(self, limit: int = 256) -> None:
        must(limit >= 1, "batch", "at least 1", limit)
        self.limit = limit
        self._made: dict[Any, Simulation] = {}

    def run(
        self,
        scenes: Sequence[Scene],
        progress: Progress | None = None,
        strict: bool = True,
        trajectory: Trajectory | None = None,
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as worlds end.

        progress : called with the finished fraction of this call, 0..1. strict : raise the InputError of a
        start that cannot be made; otherwise it becomes a failed Result. trajectory : made for these scenes;
        records them.
        """
        starts: dict[int, Arrays] = {}
        groups: dict[Any, list[int]] = {}
        for index, scene in enumerate(scenes):
            try:
                starts[index] = scene.particles.arrays(scene.domain, scene.seed)
            except InputError as error:
                if strict:
                    raise
                failed = Status(False, str(error))
                yield index, Result(scene, {}, {}, 0.0, {}, failed, 0.0, runtime.current().settings)
                continue
            groups.setdefault(scene.structure(), []).append(index)
        done = len(scenes) - len(starts)
        for members in groups.values():
            simulation = self.simulation([scenes[k] for k in members])
            for begin in range(0, len(members), simulation.worlds):
                batch = members[begin : begin + simulation.worlds]
                simulation.load([scenes[k] for k in batch], [starts.pop(k) for k in batch])
                if trajectory:
                    trajectory.record(simulation, batch)
                chunks = simulation.chunks()
                given: set[int] = set()
                while len(given) < len(batch):
                    new = [w for w in simulation.ended() if w not in given]
                    yield from zip((batch[w] for w in new), simulation.results(new), strict=True)
                    given.update(new)
                    next(chunks, None)
                    if progress:
                        progress((done + len(batch) * simulation.fraction()) / len(scenes))
                done += len(batch)

    def simulation(self, scenes: Sequence[Scene]) -> Simulation:
        """A compiled simulation for scenes of one structure; made anew only when it must be larger."""
        if self._made and next(iter(self._made.values())).s.stale:
            self._made.clear()
        key, capacity = scenes[0].structure(), max(scene.capacity() for scene in scenes)
        worlds = max(1, min(len(scenes), self.limit, SLOTS // capacity))
        old = self._made.pop(key, None)
        if old is None or old.s.capacity < capacity or old.worlds < worlds:
            if old is not None:
                old.close()
                capacity = max(capacity, old.s.capacity)
            while len(self._made) >= KEPT:
                self._made.pop(next(iter(self._made))).close()
            old = Simulation(scenes[0], worlds, capacity)
        self._made[key] = old
        return old

    def close(self) -> None:
        """Give the device memory back."""
        for simulation in self._made.values():
            simulation.close()
        self._made.clear()
