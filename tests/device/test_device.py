"""A device gives the CPU's result for a scene, to rounding; and the number of times that a step waits for it.

TISIM_DEVICE=cuda python -m pytest -n 0 -m gpu
"""

import os
import subprocess
import sys

import numpy as np
import pytest

from tests.device.launches import assert_launches
from tests.device.scenes import SCENES, STEPS
from tests.engine.test_fast import numbers
from tests.scenes import compiled
from tisim.geometry import Plane
from tisim.operators import AtRest, Outflow

pytestmark = [
    pytest.mark.gpu,
    pytest.mark.skipif(
        os.environ.get("TISIM_DEVICE", "cpu") == "cpu", reason="TISIM_DEVICE names no device: cuda or vulkan"
    ),
]
MAGNIFIED = {"grains": 1e-11, "impacts": 1e-9, "fast": 1e-11}
"""The largest growth of rounding errors in these few steps, relative to the largest value."""
ON_CPU = """
import sys
import numpy as np
from tests.device.launches import assert_launches
from tests.device.scenes import SCENES
from tisim import Simulation

for name, scene in SCENES.items():
    simulation = Simulation(scene())
    simulation.load(scene())
    simulation.run()
    (result,) = simulation.results()
    np.savez(f"{sys.argv[1]}/{name}.npz", **result.state)
"""


@pytest.fixture(scope="module")
def on_cpu(tmp_path_factory):
    """The states computed by the CPU, by name of the scene."""
    folder = tmp_path_factory.mktemp("cpu")
    command = [sys.executable, "-c", ON_CPU, str(folder)]
    subprocess.run(command, check=True, env={**os.environ, "TISIM_DEVICE": "cpu"})
    return {name: dict(np.load(folder / f"{name}.npz")) for name in SCENES}


def simulation(name, *more):
    """The compiled simulation of a scene and further effects, with the scene loaded."""
    scene = SCENES[name]()
    scene = scene.model_copy(update={"effects": (*scene.effects, *more)})
    loaded = compiled(scene, capacity=scene.capacity())
    loaded.load(scene)
    return loaded


@pytest.mark.parametrize("name", SCENES)
def test_a_device_and_the_cpu_agree(name, on_cpu):
    loaded = simulation(name)
    loaded.run()
    (result,) = loaded.results()
    assert result.status.ok, result.status.reason
    for field, expected in on_cpu[name].items():
        tolerance = MAGNIFIED[name] * np.abs(expected).max()
        np.testing.assert_allclose(result.state[field], expected, rtol=0, atol=tolerance, err_msg=field)


def test_sums_are_compensated():
    """As for the clocks of steps: a driver that regroups sums would lose the compensation, which is 2e-8 of
    this sum of tenths."""
    _, total = numbers()
    assert total == pytest.approx(1e4, rel=1e-15)


def test_a_step_takes_two_launches_and_few_queries():
    assert_launches(simulation("grains"), STEPS, each=2)


@pytest.mark.parametrize("look", [AtRest(time=9.0), Outflow(planes=[Plane(point=(0.0, 0.0, -9.0))])])
def test_a_step_with_a_later_operator_takes_five_launches(look):
    """The operator acts between two fillings of slots, after which forces may be summed again."""
    assert_launches(simulation("grains", look), STEPS, each=5)
