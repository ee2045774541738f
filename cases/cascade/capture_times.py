"""When the particles of a cascade are captured, stage after stage."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from tisim.cases.cascade.scene import Cascade
from tisim.cases.runs import sound

from tisim import run
from tisim.engine.batches import Progress

CAPTURED_SHARE = 0.9
"""Capture is timed until this share of the particles is captured."""
MAX_STAGES = 1000
"""A cascade is given up after so many stages."""


def captured_at(
    cascades: Sequence[Cascade],
    repeats: int,
    share: float = CAPTURED_SHARE,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[np.ndarray]:
    """When each particle was captured, s from the start of the cascade; inf for those still free when
    ``share`` had been, or after MAX_STAGES. One array (repeats, number) for each cascade, rows sorted.

    A stage of all cascades and repeats that are not done is one batch of worlds. RunError when one fails.
    """
    times = [np.full((repeats, one.number), np.inf) for one in cascades]
    rows = [
        (one, times[k][repeat], np.random.default_rng([seed, k, repeat]))
        for k, one in enumerate(cascades)
        for repeat in range(repeats)
    ]
    for passed in range(MAX_STAGES):
        going = [row for row in rows if np.isfinite(row[1]).mean() < share]
        if not going:
            break
        results = sound(run([one.scene(int(np.isinf(at).sum()), generator) for one, at, generator in going]))
        for (one, at, _), result in zip(going, results, strict=True):
            when = result.state["captured_at"]
            # A particle has no name in the next stage: those that are captured fill the row from its start.
            first = int(np.isfinite(at).sum())
            caught = np.sort(when[when >= 0])
            at[first : first + len(caught)] = passed * one.stage + caught
        if progress:
            progress(min(1.0, float(np.mean([np.isfinite(at).mean() for _, at, _ in rows])) / share))
    return times


def time_to(share: float, times: np.ndarray) -> np.ndarray:
    """When a share of the particles was captured, of each repeat: shape (repeats,), s; inf for never."""
    return np.asarray(times[:, int(np.ceil(share * times.shape[1])) - 1])
