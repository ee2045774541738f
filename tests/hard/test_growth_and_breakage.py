"""Limits of merging and breaking: all particles, long runs, the last free slot and beyond."""

import numpy as np
import pytest

from tests.engine.test_schedules import BATCH
from tests.scenes import GRAIN, HEAT_CAPACITY, RADIUS, check_sums, flow, hit, laws, momentum, simulate
from tisim.effects import Heating, Impact
from tisim.operators import Fragmentation


def run(scenes):
    """Run with a capacity of 200, in the batch that test_schedules has compiled."""
    return simulate(scenes, worlds=BATCH, capacity=200, schedule="world")


@pytest.mark.slow
def test_all_particles_merge_into_one():
    """All particles bond, also across periodic faces, into one sphere of the total mass.

    Its mass, radius and velocity are right to rounding.
    """
    scene = flow(seed=5, grains=150, hardness=10.0, side=0.016, images=True, duration=0.05)
    (result,) = run([scene])
    check_sums(result)
    assert len(result.state["mass"]) == 1
    assert result.work["merges"] == 149
    assert result.state["radius"][0] == pytest.approx(150 ** (1 / 3) * RADIUS, rel=1e-13)
    np.testing.assert_allclose(
        result.state["velocity"][0], momentum(result.start) / (150 * GRAIN), rtol=1e-12
    )


@pytest.mark.slow
def test_balances_close_in_a_long_violent_flow():
    """Grains merge, break and cool for thousands of steps; mass, momentum and energy balances close."""
    worlds = [
        flow(
            seed=k,
            grains=80,
            hardness=h,
            surface_energy=g,
            grain_mass=GRAIN / 2,
            threshold=0.79,
            duration=4e-3,
        )
        for k, (h, g) in enumerate([(3e5, 10.0), (3e6, 1.0), (3e6, 30.0), (1e7, 3.0)])
    ]
    results = run(worlds)
    for result in results:
        check_sums(result)
        assert result.state["mass"].min() >= GRAIN / 2 * (1 - 1e-6)
    assert sum(r.work["fractures"] for r in results) > 30
    assert sum(r.work["merges"] for r in results) > 100


@pytest.mark.slow
def test_fragments_of_one_grain_fill_every_slot():
    """Two grains of 32 break into 64 fragments, which is exactly the capacity; nothing is lost."""
    radius = RADIUS * 32 ** (1 / 3)
    scene = hit(1e3, laws(1.0, surface_energy=1.0), radius=radius)
    assert scene.capacity() == 64
    (result,) = simulate([scene], worlds=64, capacity=64)
    check_sums(result)
    assert len(result.state["mass"]) == 64
    np.testing.assert_allclose(result.state["mass"], GRAIN, rtol=1e-13)
    assert np.unique(result.state["id"]).tolist() == list(range(64))


class Optimist(Fragmentation):
    """Underestimates the capacity it needs."""

    def capacity(self, masses):
        return 64


@pytest.mark.slow
def test_more_fragments_than_the_capacity_is_a_clear_failure():
    """The world stops, says so, names the grain and keeps the last good state; the other world continues."""
    effects = (
        Impact(hardness=1.0),
        Heating(heat_capacity=HEAT_CAPACITY),
        Optimist(surface_energy=1.0, grain_mass=GRAIN),
    )
    radius = RADIUS * 100 ** (1 / 3)
    full, fine = (hit(v, effects, radius=radius, steps=4) for v in (1e3, 1e-3))
    # Compiled for more particles; the capacity of the scene is the limit.
    broken, whole = simulate([full, fine], worlds=2, capacity=256)
    assert not broken.status.ok
    assert "more particles than the capacity" in broken.status.reason
    assert "at particle 0" in broken.status.reason
    assert "at t = " in broken.status.reason
    for name in ("position", "velocity", "mass", "radius", "temperature"):
        np.testing.assert_array_equal(broken.state[name], broken.start[name])
    assert whole.status.ok
    assert len(whole.state["mass"]) == 2
