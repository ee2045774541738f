"""Stress: that of particles, by their motion and the virial of their forces, and that on walls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tisim.analysis.profiles import layer_means, layers
from tisim.engine.result import Result
from tisim.errors import must


def stress_tensor(result: Result, volume: float | None = None) -> np.ndarray:
    """Return the mean stress (Pa) of the particles of a result, tension positive, a force along b on a face
    across a at [a, b]; shape (3, 3).

        sigma = -(sum m c (x) c + W) / V,    c = v - u - mean of that

    W is the virial of pair forces, which the effect ``virial`` of the scene has summed; u is the flow of a
    sheared box. In a flow along x that grows along y sigma_xy is positive, and the pressure is minus a third
    of the trace.

    volume : V, m^3, that of the box unless given, where it is periodic along all axes. InputError is raised
    without the effect, or where there is no such volume. Forces at walls and of fields are no part of it; in
    between walls it is the stress in the grains alone.

    Source: J. H. Irving, J. G. Kirkwood, J. Chem. Phys. 18 (1950) 817.
    """
    state, domain = result.state, result.scene.domain
    must("virial" in state, "scene", "with the effect virial for a stress", sorted(state))
    if volume is None:
        must(all(domain.joined()), "volume", "given unless all faces of the box are joined", None)
        volume = float(np.abs(np.linalg.det(domain.edges(result.time))))
    must(volume > 0, "volume", "above 0 m^3", volume)
    return -(streaming_part(result) + state["virial"].sum(axis=0).reshape(3, 3)) / volume


def streaming_part(result: Result) -> np.ndarray:
    """Return what the motion of particles adds to the virial of their forces, sum m c (x) c with the velocity
    c beside the mean flow, J; shape (3, 3)."""
    state = result.state
    mass, velocity = state["mass"].astype(float), state["velocity"].astype(float)
    beside = velocity - result.scene.domain.streaming_velocity(state["position"].astype(float))
    beside -= mass @ beside / mass.sum()
    return np.asarray(np.einsum("n,na,nb->ab", mass, beside, beside))


def stress_profile(result: Result, edges: np.ndarray, area: float, axis: int = 2) -> np.ndarray:
    """Return the stress (Pa) in each layer between ``edges`` (m, rising) along an axis, as ``stress_tensor``
    has it of all; of velocities beside the mean of each layer; shape (edges - 1, 3, 3).

    area : that of the box or container across the axis, m^2. Each particle has the half of each of its pairs,
    in the layer where its centre is: layers should be wider than a diameter, and in layers at a wall a part
    of the force goes through the wall, which is no pair. Away from walls and field forces a steady flow has
    the same stress on all layers as on the walls.
    """
    state = result.state
    must("virial" in state, "scene", "with the effect virial for a stress", sorted(state))
    must(area > 0, "area", "above 0 m^2", area)
    position, edges = state["position"].astype(float), np.asarray(edges, float)
    mass, velocity = state["mass"].astype(float), state["velocity"].astype(float)
    velocity -= result.scene.domain.streaming_velocity(position)
    layer, inside = layers(position, edges, axis)
    momentum = layer_means(position, mass[:, None] * velocity, edges, axis)
    means = momentum / layer_means(position, mass, edges, axis)[:, None]
    beside, mass = velocity[inside] - means[layer], mass[inside]
    parts = np.einsum("n,na,nb->nab", mass, beside, beside).reshape(-1, 9) + state["virial"][inside]
    sums = np.column_stack([np.bincount(layer, column, len(edges) - 1) for column in parts.T])
    return -sums.reshape(-1, 3, 3) / (area * np.diff(edges))[:, None, None]


def stress_on_wall(measures: Mapping[str, float | np.ndarray], name: str, area: float) -> np.ndarray:
    """Return the force of particles on a wall or a driven group over an area (m^2), Pa: the last axis is x,
    y, z; over time, of ``MeasureSeries``, shape (times, 3).

    measures : those of a result, or of a time series. name : of the body, as in ``lid_force_z``.
    """
    must(f"{name}_force_x" in measures, "name", "that of a body with measures of its force", name)
    must(area > 0, "area", "above 0 m^2", area)
    force = [np.asarray(measures[f"{name}_force_{axis}"], float) for axis in "xyz"]
    return np.stack(force, axis=-1) / area
