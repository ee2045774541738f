"""The observer of the largest height of each particle, for throws with known heights."""

import numpy as np
import pytest

from tests.scenes import by_id, roundoff, scene, simulate
from tisim import InputError
from tisim.effects import Gravity
from tisim.operators import PeakHeight

G, DT = 10.0, 1e-3
"""Gravity (m/s^2) and step (s)."""
UP = np.array([[0.0, 0.0, 2.0], [1.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
"""Velocities of three throws (m/s): two rise and come down, and one only falls."""


def thrown(direction=(0.0, 0.0, 1.0), steps=300):
    return scene(
        [[0.0, 0, 0.5], [1.0, 0, 0], [2.0, 0, 0]], UP,
        (Gravity(acceleration=(0.0, 0.0, -G)), PeakHeight(direction=direction)), dt=DT, steps=steps,
    )  # fmt: skip


def heights(*scenes):
    return [by_id(one)["peak_height"] for one in simulate(scenes, worlds=4, capacity=4)]


def test_each_particle_has_its_own_peak_height():
    """The record is v^2/(2 g) from v/g on, the present height before, and 0 for a falling particle.

    Along another direction, of any length, it is the component along that direction.
    """
    whole, begun, along = heights(thrown(), thrown(steps=50), thrown(direction=(3.0, 0.0, 0.0)))
    few = 1e3 * roundoff()
    # Steps end at each highest point, and velocity Verlet is exact in a uniform field.
    np.testing.assert_allclose(whole, [0.2, 0.05, 0.0], rtol=few)
    time = 50 * DT
    np.testing.assert_allclose(begun, [*(UP[:2, 2] * time - G * time**2 / 2), 0.0], rtol=few)
    np.testing.assert_allclose(along, [0.0, 300 * DT, 0.0], rtol=few)


def test_a_direction_of_no_length_is_refused():
    with pytest.raises(InputError, match=r"peak_height.direction must be"):
        PeakHeight(direction=(0.0, 0.0, 0.0))
