"""Avalanches that are compared: those of one size of grains and one field, by their starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from tisim.cases.avalanche.stages import Avalanche


def of(runs: Sequence[Avalanche], diameter: float, field: float) -> list[Avalanche]:
    """Return the avalanches of a diameter (m) in a field (T), in the order of their seeds."""
    chosen = [one for one in runs if one.diameter == diameter and one.field == field]
    return sorted(chosen, key=lambda one: one.seed)


def steeper_by(these: Sequence[Avalanche], those: Sequence[Avalanche]) -> np.ndarray:
    """Return by how many degrees the slopes of some are steeper than those of others of the same starts."""
    return np.array([a.angle - b.angle for a, b in zip(these, those, strict=True)])
