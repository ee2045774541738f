"""Runs of a small valve: grains flow, a field arrests them, and walls bear the drag on them."""

import numpy as np
import pytest

from tisim.cases.common.runs import overlap
from tisim.cases.valve.measures import clusters, drag_pressure, held_pressure, unhindered_rate
from tisim.cases.valve.runs import FLOW_SAMPLES, flows
from tisim.cases.valve.scene import scene

UM = 1e-6
SMALL_VALVE = {"throat": 176 * UM, "bore": 308 * UM, "length": 400 * UM, "flowing": 6e-5, "lasting": 3e-4}


@pytest.fixture(scope="module")
def three():
    return flows([scene(**SMALL_VALVE, flux=flux, pressure=40e3) for flux in (0.0, 0.1, 0.5)])


@pytest.fixture(scope="module")
def further():
    """Flows from two more starts in the strong field."""
    return flows([scene(**SMALL_VALVE, flux=0.5, pressure=40e3, seed=seed) for seed in (1, 2)])


@pytest.mark.slow
def test_grains_flow_without_a_field(three):
    """The rate is above half of the unhindered rate, and equal in all runs until the field is switched on."""
    for flow in three:
        mass = flow.result.state["mass"].sum()
        assert 0.5 < flow.open_rate / unhindered_rate(flow.result.scene, mass) < 1.1
        assert len(flow.times) in (FLOW_SAMPLES, FLOW_SAMPLES + 1)
        np.testing.assert_array_equal(flow.rates[:16], three[0].rates[:16])
    assert three[0].left > 0.5


@pytest.mark.slow
def test_a_field_arrests_the_flow_and_walls_bear_the_drag(three, further):
    weak, strong = three[1:]
    assert strong.left < weak.left
    jammed = [strong, *further]
    for flow in jammed:
        assert flow.arrested
        assert held_pressure(flow.result) == pytest.approx(drag_pressure(flow.result), rel=0.1)
        assert 0 < overlap(flow.result) < 0.15
    # In one of six starts the jam has no chain of contacts between opposite sides.
    assert sum(clusters(flow.result.state, flow.result.scene).bridged for flow in jammed) >= 2
