"""The quantities whose accuracy ``tisim cost`` measures in the blast of Z16: where the particles are; where
they touch, the cloud's shape."""

from __future__ import annotations

import numpy as np

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import displacement
from tisim.effects import PairForce
from tisim.scene.initial_state import Arrays


def half_axes(state: Arrays) -> np.ndarray:
    """Half axes, m, of the ellipsoid with the second moments of the cloud: sqrt(5 <r_k^2>) for x, y, z."""
    r = state["position"] - np.average(state["position"], axis=0, weights=state["mass"])
    return np.sqrt(5.0 * np.average(r**2, axis=0, weights=state["mass"]))


def of_the_end(result: Result) -> np.ndarray:
    """Half axes of the cloud at the end of a run, m."""
    return half_axes(result.state)


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths can be followed as long as particles do not touch; then it is the mean over random starts."""
    if any(isinstance(effect, PairForce) for effect in scene.effects):
        return (Quantity("half-axes of the cloud", of_the_end, random=True),)
    return (Quantity("positions", displacement, returns=True),)
