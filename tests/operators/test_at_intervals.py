"""What acts at intervals does so once in each, however times are rounded."""

import pytest

from tests.scenes import scene, simulate
from tisim.backend.taichi import ti
from tisim.effects import WorldField, parameter
from tisim.operators.at_intervals import AtIntervals

DT, STEPS = 1e-6, 5003
"""s; of no interval below is the end a multiple."""


class Chime(AtIntervals):
    """Counts the times that it has acted."""

    world_fields = (WorldField("chimes", "counter"),)

    interval: float = parameter("s", "time from one to the next", gt=0, examples=[1.0])

    @ti.func
    def world(self, s, w):
        self.count_interval(s, w)
        s.chimes[w] += 1


@pytest.fixture(scope="module")
def chimes():
    """How often it acts in 5003 steps, by interval: some that steps divide, one that they do not, and two
    that are over in each step, of which there are far more than an integer of 32 bits counts."""
    intervals = (1e-5, 3e-6, 7e-4, 3.1415927e-6, 1e-20, 1e-30)
    scenes = [
        scene([[0, 0, 0]], [[0, 0, 0]], (Chime(interval=one),), dt=DT, steps=STEPS) for one in intervals
    ]
    results = simulate(scenes, worlds=len(scenes), capacity=4)
    return dict(zip(intervals, (result.work["chimes"] for result in results), strict=True))


@pytest.mark.parametrize("interval", [1e-5, 3e-6, 7e-4, 3.1415927e-6])
def test_it_acts_once_in_each_interval(chimes, interval):
    assert chimes[interval] == int(STEPS * DT / interval)


@pytest.mark.parametrize("interval", [1e-20, 1e-30])
def test_it_acts_in_each_step_of_many_intervals(chimes, interval):
    assert chimes[interval] == STEPS
