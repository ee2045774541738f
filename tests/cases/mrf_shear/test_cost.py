"""What a step costs: L21's printed times, and the count of neighbours beside it."""

import numpy as np
import pytest

from tests.benchmarks.mrf_cost import MODELS, neighbours
from tisim import GrainClass
from tisim.cases.common import magnetorheological_fluid as fluid
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.scene import scene


def test_core_times_of_l21():
    """Wall time of a step times cores over grains, us (L21 section 2.4.3)."""
    found = [1e6 * one.core_time for one in published.COSTS.values()]
    assert found == pytest.approx([6.96, 2.34, 31, 8.74, 14.4, 50.6], rel=2e-3)
    assert MODELS == ("l21", "l21_monodisperse", "l21_volume", "l21_bidisperse")


def test_neighbours_equal_a_count_of_all_pairs():
    """Of grains of several sizes; images count along x and y, and not along z."""
    grains: tuple[GrainClass, ...] = fluid.magnetorheological(0.0)
    made = scene(grains=grains, sides=(60e-6, 60e-6, 40e-6), raft=5e-6, seed=2)
    start = made.start()
    place, radius = start["position"], start["radius"]
    apart = place[:, None] - place
    apart[..., :2] -= 60e-6 * np.round(apart[..., :2] / 60e-6)
    near = np.linalg.norm(apart, axis=2) <= radius[:, None] + radius + published.NEIGHBOUR_GAP
    assert neighbours(made) == pytest.approx((near.sum() - len(place)) / len(place))
