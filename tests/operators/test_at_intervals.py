"""Operators that act at intervals act exactly once in each, regardless of the rounding of times."""

import pytest

from tests.scenes import scene, simulate
from tisim.backend.taichi import ti
from tisim.effects import WorldField, parameter
from tisim.operators.at_intervals import AtIntervals

DT, STEPS = 1e-6, 5003
"""Duration (s), which is not a multiple of any interval below."""


class Chime(AtIntervals):
    """Counts its calls."""

    world_fields = (WorldField("chimes", "counter"),)

    interval: float = parameter("s", "time from one to the next", gt=0, examples=[1.0])

    @ti.func
    def world(self, s, w):
        self.count_interval(s, w)
        s.chimes[w] += 1


@pytest.fixture(scope="module")
def chimes():
    """Number of calls in 5003 steps for each interval.

    Some intervals are multiples of the step, one is not, and two are so short that their number exceeds a
    32-bit integer.
    """
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
