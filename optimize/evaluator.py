"""Runs the scenes of a search in batches on a compiled simulation of fixed size: compile once, load many."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tisim import runtime
from tisim.errors import InputError, must
from tisim.particles import Arrays
from tisim.result import Result, Status
from tisim.scene import Scene
from tisim.simulation import Simulation

SLOTS = 300_000
"""Particles of all worlds of a batch together; keeps its memory to some hundred MB."""


class Evaluator:
    """Scenes to results, many worlds at a time, under the running settings of tisim.runtime.

    batch : most worlds that run side by side. A batch is yielded when it has ended, before the next starts,
    so that whoever keeps results loses one batch at most. A scene whose start cannot be made gives a
    failed Result. settings : what decides the last bits of a result beside the scene.
    """

    def __init__(self, batch: int = 256) -> None:
        must(batch >= 1, "batch", "at least 1", batch)
        self.batch = batch
        self.settings: dict[str, Any] = dict(runtime.current().settings)
        self._made: dict[Any, Simulation] = {}

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result), batch by batch; scenes of one structure share batches.

        progress : called with the finished fraction of this call, 0..1. KeyboardInterrupt raised by it ends
        the call; what has been yielded stands.
        """
        groups: dict[Any, list[int]] = {}
        starts: dict[int, Arrays] = {}
        for index, scene in enumerate(scenes):
            try:
                starts[index] = scene.particles.arrays(scene.domain, scene.seed)
            except InputError as error:
                yield index, self._unmade(scene, error)
                continue
            groups.setdefault(scene.structure(), []).append(index)
        done = len(scenes) - len(starts)
        for members in groups.values():
            simulation = self._simulation(scenes[members[0]], max(scenes[k].capacity() for k in members))
            for begin in range(0, len(members), simulation.worlds):
                batch = members[begin : begin + simulation.worlds]
                simulation.load([scenes[k] for k in batch], [starts.pop(k) for k in batch])
                simulation.run(_scaled(progress, done / len(scenes), len(batch) / len(scenes)))
                yield from zip(batch, simulation.results(), strict=True)
                done += len(batch)

    def _simulation(self, scene: Scene, capacity: int) -> Simulation:
        """One per structure; made anew only when a scene needs more room than any before."""
        key = scene.structure()
        old = self._made.get(key)
        if old is None or old.s.capacity < capacity:
            if old is not None:
                old.close()
            worlds = max(1, min(self.batch, SLOTS // capacity))
            self._made[key] = Simulation(scene, worlds, capacity)
        return self._made[key]

    def _unmade(self, scene: Scene, error: InputError) -> Result:
        return Result(scene, {}, {}, 0.0, {}, Status(False, str(error)), 0.0, dict(self.settings))

    def close(self) -> None:
        """Give the device memory back."""
        for simulation in self._made.values():
            simulation.close()
        self._made.clear()


def _scaled(
    progress: Callable[[float], None] | None, before: float, share: float
) -> Callable[[float], None] | None:
    return None if progress is None else lambda fraction: progress(before + share * fraction)
