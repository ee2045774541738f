"""Final errors relative to the requested one, for forces with kinks or jumps.

    python -m pytest -n 0 -m slow -s tests/steppers/test_kinked_forces.py

prints, for each kind of scene in kinked.py, the median and the largest ratio of the final error to the
requested one.
"""

import numpy as np
import pytest

import tisim
from tests.steppers.kinked import KINDS, RADIUS, error
from tisim import effects as laws
from tisim import sources
from tisim.steppers import Collocation, ErrorControl, StageControl, Trapezoid

pytestmark = pytest.mark.long

ASKED = (1e-3, 1e-5, 1e-7)
PAIRS = ("mie_at_its_cutoff", "powers_with_a_cutoff")
STRIDE = {name: 0.025 for name in PAIRS}
"""Half a radius (m); in longer steps particles may pass short-ranged forces undetected."""
LARGEST = {
    "run": dict.fromkeys(KINDS, 15.0) | dict.fromkeys(PAIRS, 100.0),
    "step": dict.fromkeys(KINDS, 50.0) | dict.fromkeys(PAIRS, 800.0),
}
"""The largest ratio stated in docs/steppers.md, with a margin: for errors per run and per step."""


def ratios(name, make, number):
    """Return ratios of the final to the requested error, shape (asked, scenes).

    make : function of (error, stride, duration in s) that returns a stepper.
    """
    drawn = [KINDS[name](np.random.Generator(np.random.Philox(key=[k, 1]))) for k in range(number)]
    found = []
    for asked in ASKED:
        results = tisim.run(
            [
                tisim.Scene(
                    particles=scene.particles, effects=scene.effects, duration=scene.duration,
                    stepper=make(asked, STRIDE.get(name, 0.0), scene.duration),
                )
                for scene, _ in drawn
            ]
        )  # fmt: skip
        found.append([error(s, end, r) / asked for (s, end), r in zip(drawn, results, strict=True)])
    return np.array(found)


def collocation(stages, per="run"):
    """Return a function that makes a collocation stepper with a number of stages for an error."""
    return lambda asked, stride, duration: Collocation(
        stages=stages, control=StageControl(error=asked, per=per, stride=stride)
    )


def trapezoid(per="run"):
    """Return a function that makes a trapezoidal stepper for an error; steps are bounded, because a jump may
    be hidden within one."""
    return lambda asked, stride, duration: Trapezoid(
        control=ErrorControl(
            error=asked, tolerance=1e-2 * asked, per=per, longest=duration / 50, stride=stride
        )
    )


@pytest.mark.parametrize("name", [pytest.param("constriction", marks=pytest.mark.slow), "flow_that_begins"])
def test_collocation_meets_the_requested_error_past_kinks(name):
    assert ratios(name, collocation(5), 12).max() < LARGEST["run"][name]


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("stepper", ["collocation 3", "collocation 5", "trapezoid"])
@pytest.mark.parametrize("per", LARGEST)
def test_40_scenes_of_each_kind(name, stepper, per, capsys):
    make = trapezoid(per) if stepper == "trapezoid" else collocation(int(stepper[-1]), per)
    found = ratios(name, make, 40)
    with capsys.disabled():
        cells = (f"{np.median(one):7.2g} {one.max():7.2g}" for one in found)
        print(f"\n{name:32s} {stepper:14s} per {per:5s}", *cells, sep=" | ")
    assert found.max() < LARGEST[per][name]


@pytest.mark.slow
def test_fields_with_and_without_a_start_time_run_in_one_batch():
    """Each has the error estimate that suits it, and the bits equal separate runs."""
    scenes = [
        tisim.Scene(
            particles=tisim.Particles(
                position=[(0, 0, 0)], velocity=[(1, 0, 0)], radius=RADIUS, mass=1.0,
                quantities={"charge": [1.0]},
            ),
            effects=(
                laws.Lorentz(), sources.ElectricField(amplitude=(1, 0, 0), omega=(50, 0, 0), begin=begin)
            ),
            stepper=Collocation(control=StageControl(error=1e-7, per="run")),
            duration=0.2,
        )
        for begin in (0.0, 0.1)
    ]  # fmt: skip
    together = tisim.run(scenes)
    for scene, result in zip(scenes, together, strict=True):
        (alone,) = tisim.run([scene])
        assert np.array_equal(alone.state["position"], result.state["position"])
        assert alone.work == result.work
