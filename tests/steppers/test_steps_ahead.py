"""Runs with more steps than can be counted are refused."""

import pytest

from tests.scenes import fixed, scene
from tests.steppers.test_straight_lines import straight
from tisim import InputError, Scene
from tisim.steppers import (
    ApproachTime,
    Collocation,
    DriftLimit,
    ErrorControl,
    FixedStep,
    IterationControl,
    StageControl,
    Trapezoid,
    Verlet,
)
from tisim.steppers.step_control import SHORTEST_STEP

ORIGIN = [[0.0, 0.0, 0.0]]


def moving(stepper, duration):
    return scene(ORIGIN, [[1.0, 2.0, 3.0]], stepper=stepper, duration=duration)


@pytest.mark.parametrize(
    ("stepper", "duration", "steps"),
    [
        (fixed(1e-3), 1e300, "1e+303"),
        (fixed(1e-30), 1.0, "1e+30"),
        (fixed(1e-30), 1e300, "1.8e+308"),
        (Verlet(), 1e300, "1e+303"),
        (Trapezoid(), 1e300, "4e+303"),
        (Trapezoid(control=ErrorControl(longest=1e300, most=1.0)), 1e15, "1e+20"),
        (Trapezoid(control=ErrorControl(longest=1e300, most=1 + 1e-15, first=1e-12)), 1e10, "1.46e+16"),
        (Collocation(), 1e300, "1e+300"),
    ],
)
def test_more_steps_than_can_be_counted_are_refused(stepper, duration, steps):
    """The message gives the duration and the number of steps, also if steps may grow, but too slowly."""
    with pytest.raises(InputError, match=r"duration must be reached in at most 9.01e\+15 steps") as refused:
        moving(stepper, duration)
    number = str(refused.value).split("takes at least ")[1].split(" of ")[0]
    assert float(number) == pytest.approx(float(steps), rel=0.01)
    assert str(refused.value).endswith(f"received {duration!r}")


def test_independent_colloids_count_intervals_with_32_bits():
    """With more intervals the noise would repeat."""
    assert straight("brownian", False, 1.0, 2.0**32).duration == 2.0**32
    with pytest.raises(
        InputError, match=r"at most 4.29e\+09 steps, but takes at least 4.3e\+09 of drift_limit"
    ):
        straight("brownian", False, 1.0, 2.0**32 * 1.001)
    assert straight("brownian", True, 1.0, 2.0**40).duration == 2.0**40


@pytest.mark.parametrize(
    "control", [FixedStep, ApproachTime, IterationControl, ErrorControl, StageControl, DriftLimit]
)
def test_steps_whose_square_underflows_are_refused(control):
    """1e-300 s is refused for every limit of a step."""
    for name in {"dt", "first", "longest", "shortest"} & set(control.model_fields):
        needed = {"longest": 1.0} if control is DriftLimit else {}
        with pytest.raises(InputError, match=f"{name} must be at least {SHORTEST_STEP}; received 1e-300"):
            control(**{**needed, name: 1e-300})


def test_too_many_steps_in_a_file_are_refused():
    data = moving(fixed(1e-3), 1.0).to_dict()
    with pytest.raises(InputError, match=r"^scene\.duration must be reached"):
        Scene.from_dict({**data, "duration": 1e300})


@pytest.mark.parametrize("control", [ErrorControl, StageControl])
def test_a_tiny_safety_factor_is_refused(control):
    """No step has an error of 1e-300 times the requested one, because rounding is larger."""
    with pytest.raises(InputError, match=r"safety must be at least 0.01; received 1e-300"):
        control(safety=1e-300)
    assert control(safety=0.01).safety == 0.01
