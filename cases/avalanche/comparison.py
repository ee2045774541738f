"""Selection and comparison of avalanches of one grain size and one field, start by start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tisim.cases.avalanche.stages import Avalanche


def of(runs: Sequence[Avalanche], diameter: float, field: float) -> list[Avalanche]:
    """Return the avalanches of a diameter (m) in a field (T), in the order of their seeds."""
    chosen = [one for one in runs if one.diameter == diameter and one.field == field]
    return sorted(chosen, key=lambda one: one.seed)


def steeper_by(these: Sequence[Avalanche], those: Sequence[Avalanche]) -> np.ndarray:
    """Return the difference in slope angle (degrees) between two groups of avalanches, start by start."""
    return np.array([a.angle - b.angle for a, b in zip(these, those, strict=True)])
