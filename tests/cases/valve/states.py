"""Synthetic states of valves."""

from types import SimpleNamespace

import numpy as np


def at_rest(made):
    """The initial state of a scene as a result, with all grains at rest."""
    return result_of(made, **made.start())


def result_of(made, position, velocity=None, radius=22e-6, mass=1.0, measures=None, **_):
    """A result of a scene with the given grains."""
    n = len(position)
    state = {
        "position": np.asarray(position, float),
        "velocity": np.zeros((n, 3)) if velocity is None else np.asarray(velocity, float),
        "radius": np.broadcast_to(radius, n).astype(float),
        "mass": np.broadcast_to(mass, n).astype(float),
    }
    return SimpleNamespace(scene=made, state=state, time=0.0, measures=measures or {})
