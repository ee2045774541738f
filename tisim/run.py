"""Run scenes, one or many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from tisim.batches import Batches, Progress
from tisim.result import Result
from tisim.scene import Scene

_batches = Batches()


@overload
def run(scenes: Scene, progress: Progress | None = None) -> Result: ...


@overload
def run(scenes: Sequence[Scene], progress: Progress | None = None) -> list[Result]: ...


def run(scenes: Scene | Sequence[Scene], progress: Progress | None = None) -> Result | list[Result]:
    """Run a scene, or many as one batch; returns its Result, or theirs in order.

    progress : called about four times a second with the finished fraction, 0..1.
    What has been compiled is kept for later calls. A world's result is the same bits alone or in a batch.
    Raises InputError when a start cannot be made or lacks what an effect needs.
    """
    if isinstance(scenes, Scene):
        return run([scenes], progress)[0]
    found = dict(_batches.run(scenes, progress))
    return [found[index] for index in range(len(scenes))]
