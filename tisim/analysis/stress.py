"""Stress of particles, from their motion and the virial of their forces, and stress on walls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tisim.analysis.profiles import layer_means, layers
from tisim.engine.result import Result
from tisim.errors import must


def stress_tensor(result: Result, volume: float | None = None) -> np.ndarray:
    """Return the mean stress (Pa) of the particles of a result, tension positive; the component [a, b] is the
    force along b on a face normal to a; shape (3, 3).

        sigma = -(sum m c (x) c + W) / V,    c = v - u - mean(v - u)

    W is the virial of pair forces, summed by the effect ``virial`` of the scene; u is the flow of a sheared
    box. In a flow along x with a velocity that increases along y, sigma_xy is positive. The pressure is minus
    a third of the trace.

    volume : V, m^3; by default the volume of a box that is periodic along all axes. InputError is raised
        without the effect, or without a volume if the box is not periodic. Forces from walls and fields are
        not included; between walls the result is the stress in the grains only.

    Source: J. H. Irving, J. G. Kirkwood, J. Chem. Phys. 18 (1950) 817.
    """
    state, domain = result.state, result.scene.domain
    must("virial" in state, "scene", "with the effect virial, which measures the stress", sorted(state))
    if volume is None:
        must(all(domain.joined()), "volume", "given, unless the box is periodic along all axes", None)
        volume = float(np.abs(np.linalg.det(domain.edges(result.time))))
    must(volume > 0, "volume", "above 0 m^3", volume)
    return -(streaming_part(result) + state["virial"].sum(axis=0).reshape(3, 3)) / volume


def streaming_part(result: Result) -> np.ndarray:
    """Return the kinetic contribution to the stress, sum m c (x) c with the velocity c relative to the mean
    flow, J; shape (3, 3)."""
    state = result.state
    mass, velocity = state["mass"].astype(float), state["velocity"].astype(float)
    beside = velocity - result.scene.domain.streaming_velocity(state["position"].astype(float))
    beside -= mass @ beside / mass.sum()
    return np.asarray(np.einsum("n,na,nb->ab", mass, beside, beside))


def stress_profile(result: Result, edges: np.ndarray, area: float, axis: int = 2) -> np.ndarray:
    """Return the stress (Pa), as ``stress_tensor``, in each layer between ``edges`` (m, increasing) along an
    axis, with velocities relative to the mean of each layer; shape (edges - 1, 3, 3).

    area : cross-section of the box or container normal to the axis, m^2.

    Half of the virial of a pair is attributed to each of its particles, in the layer of its centre. Layers
    should therefore be wider than a diameter. In layers at a wall, part of the force is transmitted by the
    wall contact, which is not a pair. Away from walls and field forces, the stress of a steady flow is equal
    in all layers and on the walls.
    """
    state = result.state
    must("virial" in state, "scene", "with the effect virial, which measures the stress", sorted(state))
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
    """Return the force of particles on a wall or a driven group per area (m^2), Pa; the last axis is x, y, z.
    For a time series, as in ``MeasureSeries``, the shape is (times, 3).

    measures : measures of a result, or of a time series.
    name : name of the body, as in ``lid_force_z``.
    """
    must(f"{name}_force_x" in measures, "name", "a body with measures of its force", name)
    must(area > 0, "area", "above 0 m^2", area)
    force = [np.asarray(measures[f"{name}_force_{axis}"], float) for axis in "xyz"]
    return np.stack(force, axis=-1) / area
