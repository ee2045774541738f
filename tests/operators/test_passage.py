"""The rate of grains through a plane, for free grains that cross it at known times."""

import numpy as np
import pytest

from tests.scenes import scene, simulate
from tisim import InputError, Scene
from tisim.effects import Tether
from tisim.geometry import Plane
from tisim.operators import Outflow, Passage

SPACING, SPEED, N, DT = 0.1, 1.0, 10, 1e-3
"""Distance between grains (m), their speed (m/s), and times (s)."""


def train(begin=0.0, end=1e30, duration=1.0, back=False, gone=10.0):
    """Grains of 1 kg, 2 kg, ... that cross x = 0, the first at 0.05 s and then one every 0.1 s."""
    place = np.outer(-SPACING * (np.arange(N) + 0.5), [1.0, 0, 0])
    velocity = np.tile([SPEED, 0.0, 0.0], (N, 1))
    return scene(
        place, velocity * (-1 if back else 1),
        (
            # It exerts no force.
            Tether(stiffness=(0.0, 0.0, 0.0)),
            Passage(planes=[Plane(point=(0, 0, 0), normal=(-1, 0, 0))], begin=begin, end=end),
            Outflow(planes=[Plane(point=(gone, 0, 0), normal=(-1, 0, 0))]),
        ),
        mass=np.arange(1.0, N + 1), dt=DT, duration=duration,
    )  # fmt: skip


@pytest.fixture(scope="module")
def results():
    scenes = [train(), train(begin=3.0, end=28.0), train(duration=0.32), train(back=True), train(gone=0.02),
              train(begin=50.0)]  # fmt: skip
    return simulate(scenes, worlds=8, capacity=N)


def test_mass_and_rate_of_the_grains_that_have_passed(results):
    everything, part, three, back, gone, few = (result.measures for result in results)
    assert everything["passed_mass"] == 55.0
    # The first grain crosses before the rate starts.
    assert everything["passage_rate"] == pytest.approx(54.0 / 0.9, rel=3e-3)
    # From the second grain, after which 3 kg have passed, to the seventh, after which it is 28 kg.
    assert part["passage_rate"] == pytest.approx(25.0 / 0.5, rel=3e-3)
    assert three["passed_mass"] == 6.0
    assert three["passage_rate"] == pytest.approx(5.0 / 0.2, rel=6e-3)
    assert back["passed_mass"] == back["passage_rate"] == few["passage_rate"] == 0.0
    # Grains that are removed right behind the plane have been counted.
    assert gone["passed_mass"] == 55.0
    assert results[4].work["outflow"] == N
    assert gone["passage_rate"] == everything["passage_rate"]


def test_the_passage_precedes_the_outflow():
    """An outflow that acts before the passage would leave no grains to count."""
    data = train(gone=0.0).to_dict()
    tether, passage, outflow = data["effects"]
    turned = {name: data["effects"][name] for name in (tether, outflow, passage)}
    rule = "^effects.passage must be listed before effects.outflow; received 'tether, outflow, passage'"
    with pytest.raises(InputError, match=rule):
        Scene.from_dict({**data, "effects": turned})
    assert Scene.from_dict(data) == train(gone=0.0)


def test_each_grain_records_its_passage(results):
    order = np.argsort(results[2].state["id"])
    np.testing.assert_array_equal(results[2].state["passed"][order], [1] * 3 + [0] * 7)
