"""Runs of cells: several settings, each from the same random starts, in one batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tisim import Result, Scene, run
from tisim.analysis import Mean
from tisim.cases.mrf_shear.measures import shear_stress
from tisim.cases.mrf_shear.scene import MAGNETISING_TIME, scene
from tisim.cases.runs import sound
from tisim.engine.batches import Progress

Settings = Mapping[str, Any]
"""Settings of ``scene`` that differ from the defaults."""


def cells(settings: Sequence[Settings], starts: int, progress: Progress | None = None) -> list[list[Result]]:
    """Return the results of cells for each setting, from a number of starts each; RunError if a run fails."""
    return grouped([scene(**one, seed=seed) for one in settings for seed in range(starts)], starts, progress)


def grouped(scenes: Sequence[Scene], starts: int, progress: Progress | None = None) -> list[list[Result]]:
    """Return the results of scenes in groups of ``starts``; RunError if a run fails."""
    results = sound(run(list(scenes), progress))
    return [results[k : k + starts] for k in range(0, len(results), starts)]


def magnetised(settings: Settings, seed: int) -> Scene:
    """Return a cell that ends at the time at which its rafts are frozen."""
    until = settings.get("magnetising", MAGNETISING_TIME)
    return scene(**settings, seed=seed).model_copy(update={"duration": until})


def paired(one: Sequence[Result], other: Sequence[Result]) -> Mean:
    """Return the ratio of the shear stresses of two settings, a mean over their common starts."""
    ratio = [shear_stress(a) / shear_stress(b) for a, b in zip(one, other, strict=True)]
    return Mean.of(np.array(ratio))
