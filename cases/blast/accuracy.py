"""Quantities whose accuracy ``tisim cost`` measures in the blast of Z16: particle positions, or the shape of
the cloud if particles touch."""

from __future__ import annotations

import numpy as np

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import displacement
from tisim.effects import PairForce
from tisim.scene.initial_state import Arrays


def half_axes(state: Arrays) -> np.ndarray:
    """Return the half axes, m, of the ellipsoid with the second moments of the cloud: sqrt(5 <r_k^2>) for x,
    y, z."""
    r = state["position"] - np.average(state["position"], axis=0, weights=state["mass"])
    return np.sqrt(5.0 * np.average(r**2, axis=0, weights=state["mass"]))


def of_the_end(result: Result) -> np.ndarray:
    """Return the half axes of the cloud at the end of a run, m."""
    return half_axes(result.state)


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the positions; if particles touch, their paths are chaotic, so return the mean shape over random
    starts."""
    if any(isinstance(effect, PairForce) for effect in scene.effects):
        return (Quantity("half-axes of the cloud", of_the_end, random=True),)
    return (Quantity("positions", displacement, returns=True),)
