"""Overlapping spheres in a frame of a trajectory, of which contact laws return the normal forces."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tisim.effects.base import Effect


@dataclass(frozen=True)
class OverlappingPairs:
    """Pairs of overlapping spheres.

    state : all particles, by field name. i, j : indices of both particles of each pair. overlap : m, shape
    (pairs,). effects : all effects of the scene, with its materials (``Scene.acting``).
    """

    state: Mapping[str, np.ndarray]
    i: np.ndarray
    j: np.ndarray
    overlap: np.ndarray
    effects: Sequence[Effect]

    @property
    def reduced_radius(self) -> np.ndarray:
        """Return R* = R_i R_j / (R_i + R_j) of each pair, m."""
        a, b = (self.state["radius"][one].astype(float) for one in (self.i, self.j))
        reduced: np.ndarray = a * b / (a + b)
        return reduced
