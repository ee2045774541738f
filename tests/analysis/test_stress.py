"""Stress of particles with known motion and known forces."""

import numpy as np
import pytest

from tests.scenes import scene
from tisim import Box, InputError, Result, ShearedBox
from tisim.analysis import streaming_part, stress_on_wall, stress_profile, stress_tensor
from tisim.effects import Mie, Virial
from tisim.engine.result import Status

MIE = Mie(epsilon=1.0)
BOX = {"low": (0, 0, 0), "high": (2, 4, 5)}


def result_of(position, velocity, virial, domain, mass=2.0):
    """A result with these arrays, without a run."""
    made = scene(position, velocity, (MIE, Virial()), radius=0.01, mass=mass, domain=domain)
    state = made.particles.arrays(made.domain, made.seed) | {"virial": virial}
    return Result(made, state, state, 0.7, {}, Status(True, ""), 0.0)


def test_the_pressure_of_an_ideal_gas_excludes_flow(rng):
    """p = n m <c^2> / 3; neither the shear flow of a sheared box nor a uniform velocity contributes."""
    n = 4000
    position, thermal = rng.uniform(size=(n, 3)) * BOX["high"], rng.normal(size=(n, 3)) * (1, 2, 3)
    domain = ShearedBox(**BOX, rate=30.0)
    flow = domain.streaming_velocity(position) + np.array([5.0, -3.0, 0.0])
    result = result_of(position, flow + thermal, np.zeros((n, 9)), domain)
    expected = -2.0 * n * np.diag([1.0, 4.0, 9.0]) / 40.0
    # Five standard deviations of means over n: sqrt(2/n) for squares, sqrt(1/n) for products.
    width = 5 * np.sqrt((1 + np.eye(3)) / n) * 2.0 * n / 40 * np.outer((1, 2, 3), (1, 2, 3))
    assert (np.abs(stress_tensor(result) - expected) < width).all()
    c = thermal - thermal.mean(axis=0)
    np.testing.assert_allclose(streaming_part(result), 2.0 * c.T @ c, rtol=1e-9, atol=1e-9 * n)


def test_a_virial_over_the_volume_is_a_pressure():
    """Also in a box with open faces, for which the volume is given."""
    position, still = np.array([[0.5, 1, 1], [0.5, 1, 2]]), np.zeros((2, 3))
    virial = np.arange(18.0).reshape(2, 9)
    result = result_of(position, still, virial, Box(**BOX))
    np.testing.assert_allclose(stress_tensor(result), -virial.sum(axis=0).reshape(3, 3) / 40.0)
    result = result_of(position, still, virial, Box(**BOX, periodic=(True, True, False)))
    np.testing.assert_allclose(stress_tensor(result, volume=8.0), -virial.sum(axis=0).reshape(3, 3) / 8.0)
    with pytest.raises(InputError, match="volume must be given, unless the box is periodic along all axes"):
        stress_tensor(result)
    with pytest.raises(InputError, match="volume must be above 0"):
        stress_tensor(result, volume=0.0)
    del result.state["virial"]
    with pytest.raises(InputError, match="scene must be with the effect virial, which measures the stress"):
        stress_tensor(result, volume=8.0)


def test_stress_on_a_wall():
    """From a single result, and over time."""
    measures = {"lid_force_x": 3.0, "lid_force_y": 0.0, "lid_force_z": 8.0}
    np.testing.assert_array_equal(stress_on_wall(measures, "lid", 2.0), [1.5, 0.0, 4.0])
    series = {name: np.full(5, value) for name, value in measures.items()}
    assert stress_on_wall(series, "lid", 2.0).shape == (5, 3)
    with pytest.raises(InputError, match="name must be a body with"):
        stress_on_wall(measures, "floor", 2.0)
    with pytest.raises(InputError, match="area must be above 0"):
        stress_on_wall(measures, "lid", 0.0)


def test_the_stress_in_layers_carries_the_weight_above():
    """A column of touching grains on a floor: the contact of layers k and k + 1 bears all grains above it."""
    n, d, weight = 20, 0.02, 3.0
    height = d * (np.arange(n) + 0.5)
    position = np.column_stack([np.full(n, 0.5), np.full(n, 0.5), height])
    borne = weight * np.arange(n)[::-1]
    virial = np.zeros((n, 9))
    # Half of r F of the contact above and, except in the lowest layer, half of r F of the contact below.
    virial[:, 8] = d * (borne + np.append(0.0, borne[:-1])) / 2
    velocity = np.column_stack([height, 0 * height, 0 * height]) * 7
    result = result_of(position, velocity, virial, Box(**BOX, periodic=(True, True, False)))
    edges = np.arange(0, 0.41, 0.1)
    found = stress_profile(result, edges, area=8.0)
    load = borne + np.append(0.0, borne[:-1])
    np.testing.assert_allclose(found[:, 2, 2], -load.reshape(4, 5).mean(axis=1) / 2 / 8.0)
    # Velocities relative to the mean of each layer of five: 7 d times 2, 1, 0, 1, 2.
    moving = 2.0 * 10 * (7 * d) ** 2 / (8.0 * 0.1)
    np.testing.assert_allclose(found[:, 0, 0], -moving)
    total = stress_tensor(result, volume=8.0 * 0.4)
    np.testing.assert_allclose(found[:, 2, 2].mean(), total[2, 2])
    with pytest.raises(InputError, match="area must be above 0"):
        stress_profile(result, edges, area=0.0)
