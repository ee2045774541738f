"""Brownian particles have the same positions for any number of CPU threads."""

import subprocess
import sys

import numpy as np
import pytest

from tests.scenes import simulate
from tests.steppers.brownian.colloids import colloids, run

ELSEWHERE = """
import sys
import numpy as np
from tests.steppers.brownian import test_threads
from tisim.backend import runtime
runtime.init(threads=1)
np.save(sys.argv[1], test_threads.PLACES[sys.argv[2]]())
"""


def places(run, worlds, number, together=False, **more):
    """Final positions of the particles.

    Each phase is a launch over all of them. With little work for each particle, fewer than a thousand
    particles would all be given to one thread.
    """
    more = {"trap": 200.0, "dt": 1e-3, "drift": 0.3, "steps": 6, **more}
    draw = np.random.default_rng(1)
    starts = draw.uniform(-1e-6, 1e-6, (worlds, number, 3))
    scenes = [colloids(start, together, seed=k, **more) for k, start in enumerate(starts)]
    results = run(scenes)
    return np.array([result.state["position"] for result in results])


def launched(scenes):
    return simulate(scenes, worlds=40, capacity=40, schedule="particle")


PLACES = {
    "by themselves": lambda: places(run, 5, 400),
    "exact": lambda: places(launched, 40, 40, hydrodynamics="rotne-prager"),
    "fast": lambda: places(launched, 40, 40, True, hydrodynamics="rotne-prager", noise="fast"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLACES)
def test_same_bits_with_one_thread_and_two(name, tmp_path):
    file = tmp_path / "places.npy"
    command = [sys.executable, "-W", "error::RuntimeWarning", "-c", ELSEWHERE, str(file), name]
    completed = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert completed.returncode == 0, completed.stderr
    np.testing.assert_array_equal(PLACES[name](), np.load(file))
