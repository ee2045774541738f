"""Ewald sums have the same bits on all schedules and thread counts, alone and in a batch."""

import numpy as np
import pytest

from tests.effects.magnetic.test_ewald import box, induced
from tests.scenes import compiled, simulate

SEED = 7


def grains(n, seed=SEED):
    """Random soft spheres, which may overlap, in a field."""
    rng = np.random.Generator(np.random.Philox(seed))
    low, high = box().bounds()
    return induced(rng.uniform(low, high, (n, 3)), 0.1, box(), scale=(0.1, 0.1, 0.1))


def moments_and_forces():
    """Moments and forces of many particles at the start, as a list."""
    simulation = compiled(grains(150), capacity=150)
    simulation.load([grains(150)])
    simulation.first.advance(1)
    s = simulation.s
    assert (s.read("failed") == 0).all()
    columns = (s.read(name)[0] / np.abs(s.read(name)).max() for name in ("moment", "force"))
    return np.concatenate(tuple(columns)).tolist()


@pytest.mark.slow
def test_the_same_bits_on_all_schedules_and_in_batches():
    """A world by one thread, by a team, by launches; alone, in a batch, and with a larger capacity."""
    scenes = [grains(n) for n in (150, 40, 3, 77)]
    together = simulate(scenes, worlds=4, capacity=150, schedule="world")
    for schedule, capacity in (("world", 200), ("team", 150), ("particle", 150)):
        for one, result in zip(scenes, together, strict=True):
            (alone,) = simulate([one], worlds=1, capacity=capacity, schedule=schedule)
            for name, values in result.state.items():
                np.testing.assert_array_equal(values, alone.state[name], err_msg=name)


@pytest.mark.slow
def test_other_threads_and_precision(single, in_one_thread):
    """On one thread: the same bits. In single precision: rounding of that precision only."""
    here = moments_and_forces()
    assert in_one_thread("effects.magnetic.test_ewald_bits", "moments_and_forces") == here
    there = single("effects.magnetic.test_ewald_bits", "moments_and_forces")
    np.testing.assert_allclose(there, here, rtol=0, atol=3e-5)
