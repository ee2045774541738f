"""Limits of merging and breaking: all particles, long runs, the last free slot and beyond."""

import numpy as np
import pytest

from tests.scenes import GRAIN, HEAT_CAPACITY, RADIUS, hit, simulate
from tisim.effects import Heating, Impact
from tisim.operators import Fragmentation


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
