"""Motion of rigid clumps, computed from the particles of a Result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation as Turn


class ClumpBodies(NamedTuple):
    """The bodies of clumps, one row per clump.

    position : centres of mass (m).
    velocity : velocities of the centres of mass (m/s).
    orientation : quaternions w, x, y, z from the principal axes to the space frame.
    angular_momentum, angular_velocity : in the space frame (kg m^2/s, rad/s).
    mass : kg.
    inertia : principal moments (kg m^2).
    energy : kinetic energies (J).
    """

    position: np.ndarray
    velocity: np.ndarray
    orientation: np.ndarray
    angular_momentum: np.ndarray
    angular_velocity: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    energy: np.ndarray


def clump_bodies(state: Mapping[str, np.ndarray]) -> ClumpBodies:
    """Return the bodies of the clumps among the particles of a Result, ``result.state``, by clump number."""
    leads = np.flatnonzero((state["clump"] >= 0) & (state["clump_member"] == state["clump_first"]))
    leads = leads[np.argsort(state["clump"][leads])]
    position, velocity, orientation, momentum, inertia = (
        state[f"clump_{name}"][leads].astype(float)
        for name in ("position", "velocity", "orientation", "angular_momentum", "inertia")
    )
    turn, mass = Turn.from_quat(np.roll(orientation, -1, axis=1)), state["body_mass"][leads].astype(float)
    in_body = turn.inv().apply(momentum)
    energy = (mass * (velocity**2).sum(axis=1) + (in_body**2 / inertia).sum(axis=1)) / 2
    spin = turn.apply(in_body / inertia)
    return ClumpBodies(position, velocity, orientation, momentum, spin, mass, inertia, energy)
