"""Capture times of the particles of a cascade, stage by stage."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tisim import run
from tisim.cases.cascade.scene import Cascade
from tisim.cases.runs import sound
from tisim.engine.batches import Progress

CAPTURED_SHARE = 0.9
"""Share of the particles at which the capture time is measured."""
MAX_STAGES = 1000
"""Largest number of stages of a cascade."""


def captured_at(
    cascades: Sequence[Cascade],
    repeats: int,
    share: float = CAPTURED_SHARE,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[np.ndarray]:
    """Return the capture time of each particle, s from the start of the cascade.

    The result is one array (repeats, number) for each cascade, with sorted rows. Particles that are still
    free when ``share`` has been captured, or after MAX_STAGES, have inf. Each stage of all unfinished
    cascades and repeats is one batch of worlds. RunError if a run fails.
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
            # Particles keep no identity between stages, so capture times fill the row from its start.
            first = int(np.isfinite(at).sum())
            caught = np.sort(when[when >= 0])
            at[first : first + len(caught)] = passed * one.stage + caught
        if progress:
            progress(min(1.0, float(np.mean([np.isfinite(at).mean() for _, at, _ in rows])) / share))
    return times


def time_to(share: float, times: np.ndarray) -> np.ndarray:
    """Return the time at which a share of the particles was captured in each repeat: shape (repeats,), s; inf
    for never."""
    return np.asarray(times[:, int(np.ceil(share * times.shape[1])) - 1])
