"""Run scenes, one or many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

from tisim.backend import runtime
from tisim.engine.batches import Batches, Progress
from tisim.engine.result import Result
from tisim.errors import must
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from tisim.io.recording import Recording

_batches = Batches()


@overload
def run(scenes: Scene, progress: Progress | None = None, record: Recording | None = None) -> Result: ...


@overload
def run(
    scenes: Sequence[Scene], progress: Progress | None = None, record: Recording | None = None
) -> list[Result]: ...


def run(
    scenes: Scene | Sequence[Scene], progress: Progress | None = None, record: Recording | None = None
) -> Result | list[Result]:
    """Run a scene, or many as one batch; return its Result, or theirs in order.

    progress : called about four times a second with the finished fraction, 0..1. record : a trajectory to
    write, such as ``Recording("flow.h5", frames=100)``; it does not change the results.
    What has been compiled is kept for later calls. A world's result is the same bits alone or in a batch.
    Several threads may call at once: each waits for its turn. ``progress`` may call this in turn.
    Raises InputError when a start cannot be made or lacks what an effect needs. A run that fails on its way
    returns a Result, whose ``status`` says so: who does not read that is warned (see Result).
    """
    if isinstance(scenes, Scene):
        return run([scenes], progress, record)[0]
    sound = isinstance(scenes, Sequence) and all(isinstance(scene, Scene) for scene in scenes)
    must(sound, "scenes", "a Scene or a list of them (Scene.from_toml reads a file)", scenes)
    with runtime.turn:
        if record is None:
            results = dict(_batches.run(scenes, progress))
        else:
            with record.create(scenes, runtime.current().precision) as trajectory:
                results = dict(_batches.run(scenes, progress, trajectory=trajectory))
    return [results[index].watched() for index in range(len(scenes))]
