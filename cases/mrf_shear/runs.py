"""Runs of cells: settings side by side, each from the same random starts, all as one batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from tisim.cases.mrf_shear.measures import shear_stress
from tisim.cases.mrf_shear.scene import MAGNETISING_TIME, scene
from tisim.cases.runs import sound

from tisim import Result, Scene, run
from tisim.analysis import Mean
from tisim.engine.batches import Progress

Settings = Mapping[str, Any]
"""Settings are those of ``scene`` that differ."""


def cells(settings: Sequence[Settings], starts: int, progress: Progress | None = None) -> list[list[Result]]:
    """Return the results of cells with each of some settings, from so many starts; RunError when one
    fails."""
    return grouped([scene(**one, seed=seed) for one in settings for seed in range(starts)], starts, progress)


def grouped(scenes: Sequence[Scene], starts: int, progress: Progress | None = None) -> list[list[Result]]:
    """Return the results of scenes, so many starts of one thing after the other; RunError when one fails."""
    results = sound(run(list(scenes), progress))
    return [results[k : k + starts] for k in range(0, len(results), starts)]


def magnetised(settings: Settings, seed: int) -> Scene:
    """Return a cell up to the time at which its rafts are frozen."""
    until = settings.get("magnetising", MAGNETISING_TIME)
    return scene(**settings, seed=seed).model_copy(update={"duration": until})


def paired(one: Sequence[Result], other: Sequence[Result]) -> Mean:
    """Return the ratio of the shear stresses of two settings, a mean over starts that both began from."""
    ratio = [shear_stress(a) / shear_stress(b) for a, b in zip(one, other, strict=True)]
    return Mean.of(np.array(ratio))
