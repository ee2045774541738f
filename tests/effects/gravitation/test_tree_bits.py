"""Gravity by a tree has the same bits on all schedules and thread counts, alone and in a batch."""

import numpy as np
import pytest

from tests.effects.gravitation.clouds import ball, forces
from tests.scenes import scene, simulate
from tisim.effects import TreeGravity


@pytest.mark.slow
def test_the_same_bits_on_all_schedules_and_in_batches(rng):
    """A world by one thread, by a team, by launches; alone, in a batch, and with a larger capacity."""
    places = [ball(rng, n) for n in (1500, 40, 3, 777)]
    scenes = [
        scene(r, 0.01 * r, (TreeGravity(opening_angle=0.6),), mass=1e7 / len(r), dt=0.1, steps=5)
        for r in places
    ]
    together = simulate(scenes, worlds=4, capacity=1500, schedule="world")
    for schedule, capacity in (("world", 3000), ("team", 1500), ("particle", 1500)):
        for one, result in zip(scenes, together, strict=True):
            (alone,) = simulate([one], worlds=1, capacity=capacity, schedule=schedule)
            for name, values in result.state.items():
                np.testing.assert_array_equal(values, alone.state[name], err_msg=name)


@pytest.mark.slow
def test_other_threads_and_precision(single, in_one_thread, rng):
    """On one thread: the same bits. In single precision: rounding of that precision only."""
    here = forces()
    assert in_one_thread("effects.gravitation.clouds", "forces") == here
    there, here = np.array(single("effects.gravitation.clouds", "forces")), np.array(here)
    np.testing.assert_allclose(there, here, rtol=0, atol=3e-5 * np.abs(here).max())
