"""Runs the scenes of a search, under the running settings of tisim.backend.runtime."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tisim import Result, Scene
from tisim.backend import runtime
from tisim.engine.batches import Batches


class BatchEvaluator:
    """Scenes to results, many worlds at a time; a start that cannot be made gives a failed Result.

    batch : most worlds that run side by side. settings : what decides the last bits of a result beside the
    scene - precision, device, arithmetic, compiler; part of the key under which it is cached.
    """

    def __init__(self, batch: int = 256) -> None:
        self.batches = Batches(batch)
        self.settings: dict[str, Any] = {**runtime.current().settings, "backend": runtime.backend()}

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as worlds end; what has been yielded stands."""
        return self.batches.run(scenes, progress, strict=False)

    def close(self) -> None:
        """Give the device memory back."""
        self.batches.close()
