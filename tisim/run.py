"""Run scenes, one or many: scenes that can share a batch do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, overload

from tisim import runtime
from tisim.result import Result
from tisim.scene import Scene
from tisim.simulation import Simulation

LARGEST_BATCH = 512

_made: dict[Any, Simulation] = {}


@overload
def run(scenes: Scene, progress: Callable[[float], None] | None = None) -> Result: ...
@overload
def run(scenes: Sequence[Scene], progress: Callable[[float], None] | None = None) -> list[Result]: ...
def run(scenes, progress=None):
    """Run a scene, or many as one batch; returns its Result, or theirs in order.

    Scenes of the same structure (effects, options, domain, stepper) run side by side. What has been compiled
    is kept for later calls. A world's result is the same bits alone or in a batch.
    """
    if isinstance(scenes, Scene):
        return run([scenes], progress)[0]
    groups: dict[Any, list[int]] = {}
    for index, scene in enumerate(scenes):
        groups.setdefault(scene.structure(), []).append(index)
    results: list[Result | None] = [None] * len(scenes)
    done = 0
    for members in groups.values():
        for begin in range(0, len(members), LARGEST_BATCH):
            batch = members[begin : begin + LARGEST_BATCH]
            ready = simulation([scenes[k] for k in batch])
            ready.load([scenes[k] for k in batch])
            before, share = done / len(scenes), len(batch) / len(scenes)
            ready.run((lambda f, b=before, s=share: progress(b + s * f)) if progress else None)
            for k, result in zip(batch, ready.results(), strict=True):
                results[k] = result
            done += len(batch)
    return results


def simulation(scenes: Sequence[Scene]) -> Simulation:
    """A compiled Simulation that holds these scenes of one structure; the last few made are kept."""
    capacity = max(scene.capacity() for scene in scenes)
    key = (runtime.generation(), runtime.current(), scenes[0].structure(), len(scenes), capacity)
    if key not in _made:
        for old in [k for k in _made if k[0] != runtime.generation()]:
            del _made[old]
        while len(_made) >= 8:
            _made.pop(next(iter(_made))).close()
        _made[key] = Simulation(scenes[0], len(scenes), capacity)
    return _made[key]
