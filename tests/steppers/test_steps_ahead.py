"""What cannot be done in as many steps as can be counted is refused; and how many steps are ahead."""

import pytest

from tests.scenes import compiled, fixed, scene, simulate
from tests.steppers.test_straight_lines import straight
from tisim import Scene
from tisim.effects.tether import Tether
from tisim.errors import InputError
from tisim.explain import explain
from tisim.steppers.collocation import Collocation
from tisim.steppers.controller import LEAST, ApproachTime, FixedStep
from tisim.steppers.drift_limit import DriftLimit
from tisim.steppers.implicit_control import ErrorControl, IterationControl
from tisim.steppers.stage_control import StageControl
from tisim.steppers.trapezoid import Trapezoid
from tisim.steppers.verlet import Verlet

ORIGIN = [[0.0, 0.0, 0.0]]


def moving(stepper, duration, effects=(), **more):
    return scene(ORIGIN, [[1.0, 2.0, 3.0]], effects, stepper=stepper, duration=duration, **more)


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
    """With the duration and the number of steps; also where steps may grow, but not fast enough."""
    with pytest.raises(InputError, match=r"duration must be reached in at most 9.01e\+15 steps") as refused:
        moving(stepper, duration)
    number = str(refused.value).split("takes at least ")[1].split(" of ")[0]
    assert float(number) == pytest.approx(float(steps), rel=0.01)
    assert str(refused.value).endswith(f"received {duration!r}")


def test_colloids_by_themselves_number_their_windows_with_32_bits():
    """More of them would have the noise of the first again."""
    assert straight("brownian", False, 1.0, 2.0**32).duration == 2.0**32
    with pytest.raises(
        InputError, match=r"at most 4.29e\+09 steps, but takes at least 4.3e\+09 of drift_limit"
    ):
        straight("brownian", False, 1.0, 2.0**32 * 1.001)
    assert straight("brownian", True, 1.0, 2.0**40).duration == 2.0**40


@pytest.mark.parametrize(
    "control", [FixedStep, ApproachTime, IterationControl, ErrorControl, StageControl, DriftLimit]
)
def test_no_step_is_shorter_than_any_time_that_numbers_can_square(control):
    """1e-300 s of any limit of a step."""
    for name in {"dt", "first", "longest", "shortest"} & set(control.model_fields):
        needed = {"longest": 1.0} if control is DriftLimit else {}
        with pytest.raises(InputError, match=f"{name} must be at least {LEAST}; received 1e-300"):
            control(**{**needed, name: 1e-300})


def test_growth_is_counted():
    """Steps that double from 1 s need ten for 1023 s, and a few more if they may be 100 s at most."""
    control = IterationControl(first=1.0, longest=2e3, most=2.0)
    assert control.fewest(1023.0) == pytest.approx(10.0)
    (result,) = simulate([moving(Trapezoid(control=control), 1023.0)])
    assert result.work["particle_steps"] == 10
    assert IterationControl(first=1.0, longest=100.0, most=2.0).fewest(1023.0) == pytest.approx(10.23)


def test_steps_ahead():
    """As many as are left at the length of the last one, in the world that has most; and as explained."""
    made = [moving(fixed(dt), 1.0) for dt in (1e-2, 1e-3)]
    simulation = compiled(made[0], worlds=8, capacity=16)
    simulation.load(made)
    assert simulation.ahead() == 1000
    simulation.run(steps=40)
    assert simulation.ahead() == pytest.approx(960, abs=1)
    simulation.run()
    assert simulation.ahead() == 0
    assert explain(made[1]).steps == pytest.approx(1000)


def test_a_step_that_time_does_not_tell_is_not_taken():
    """A spring so stiff that its steps are less than the rounding of the time at the end: it stops, and says
    so, at the first step instead of after 1e23."""
    control = ErrorControl(first=1e-20, longest=1e6, shortest=1e-25, error=1e-6, tolerance=1e-8)
    made = moving(
        Trapezoid(control=control),
        1e6,
        (Tether(stiffness=(1e40, 1e40, 1e40)),),
        mass=1.0,
        quantities={"anchor": [[1.0, 0, 0]]},
    )
    simulation = compiled(made, capacity=1)
    simulation.load([made])
    simulation.run(steps=10)
    (result,) = simulation.results()
    assert "cannot be solved even at the shortest step, by effects.tether" in result.status.reason
    assert result.time == 0.0


def test_it_is_said_of_files_too():
    data = moving(fixed(1e-3), 1.0).to_dict()
    with pytest.raises(InputError, match=r"^scene\.duration must be reached"):
        Scene.from_dict({**data, "duration": 1e300})
