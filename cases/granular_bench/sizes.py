"""The scene of each size of the case: draw-down tests, and a bed in a cup."""

from __future__ import annotations

from tisim import Scene
from tisim.cases.case import size_named
from tisim.cases.granular_bench.bed import bed
from tisim.cases.granular_bench.scene import BED, SIZES, scene


def scene_for(size: str, seed: int) -> Scene:
    """Return the scene of a size."""
    settings = size_named(size, SIZES).scene
    return bed(seed=seed, **settings) if size == BED else scene(seed=seed, **settings)
