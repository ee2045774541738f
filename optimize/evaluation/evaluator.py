"""Runs the scenes of a search, with the current settings of tisim.backend.runtime."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tisim import Result, Scene
from tisim.backend import runtime
from tisim.engine.batches import Batches


class BatchEvaluator:
    """Runs scenes as batches of many worlds; an invalid start gives a failed Result.

    batch : largest number of worlds that run side by side.
    settings : everything except the scene that affects the last bits of a result - precision, device,
        arithmetic, compiler; part of the cache key.
    """

    def __init__(self, batch: int = 256) -> None:
        self.batches = Batches(batch)
        self.settings: dict[str, Any] = {**runtime.current().settings, "backend": runtime.backend()}

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as worlds end; yielded results are final."""
        return self.batches.run(scenes, progress, strict=False)

    def close(self) -> None:
        """Release the device memory."""
        self.batches.close()
