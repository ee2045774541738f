"""The length of a step: fixed, cut at the end of the run, at its lower bound, at its upper bound."""

import numpy as np
import pytest

from tests.scenes import HEAT_CAPACITY, RADIUS, by_id, check_sums, compiled, fixed, scene, simulate
from tisim import InputError
from tisim.effects import Heating, Impact
from tisim.steppers import ApproachTime, Verlet


def run(scenes):
    return simulate(scenes, worlds=8, capacity=16)


def test_fixed_steps_end_exactly_on_time():
    """The duration is not a multiple of the step: the last step is cut, and the time is exact."""
    results = run(
        [
            scene([[0, 0, 0]], [[1.0, 2, 3]], (), stepper=fixed(dt), duration=1.0)
            for dt in (0.3, 1 / 3, 0.1, 7.0, 1e-4)
        ]
    )
    for result, steps in zip(results, (4, 3, 10, 1, 10_000), strict=True):
        assert result.time == 1.0
        assert result.work["steps"] == steps
        np.testing.assert_allclose(result.state["position"], [[1, 2, 3]], rtol=1e-12)


def row():
    """Hard grains in a row with tiny gaps, each moving at 50 m/s against the next."""
    grains = 12
    return scene(
        np.arange(grains)[:, None] * [2 * RADIUS * (1 + 1e-9), 0, 0],
        np.where(np.arange(grains) % 2, -50.0, 50.0)[:, None] * [1.0, 0, 0],
        (Impact(hardness=1e9), Heating(heat_capacity=HEAT_CAPACITY)),
        stepper=Verlet(),
        duration=2e-4,
        quantities={"temperature": 300.0},
    )


@pytest.mark.slow
def test_step_control_at_its_lower_bound():
    """The gaps are far smaller than v times the shortest step: the step stays at its lower bound, the run
    ends."""
    simulation = compiled(row(), 8, 16)
    simulation.load([row()])
    simulation.run(steps=1)
    (first,) = simulation.results()
    assert first.time == 1e-6, "gap over speed would be 2e-14 s"
    (result,) = run([row()])
    check_sums(result)
    assert result.time == 2e-4
    assert result.work["steps"] <= 201, "never shorter than the floor of 1e-6 s"
    grains = len(result.start["mass"])
    assert result.work["impacts"] >= grains - 1
    order = np.argsort(by_id(result)["position"][:, 0])
    np.testing.assert_array_equal(order, np.arange(grains), "none has passed through another")


@pytest.mark.long
def test_a_single_grain_takes_the_longest_step():
    """A single grain takes steps at the upper bound, so few steps."""
    alone = scene([[0, 0, 0]], [[100.0, 0, 0]], row().effects, stepper=Verlet(), duration=0.01,
                  quantities={"temperature": 300.0})  # fmt: skip
    (result,) = run([alone])
    assert result.status.ok
    assert result.work["steps"] == 10


@pytest.mark.slow
def test_a_scene_too_fast_for_the_default_steps_is_refused():
    """Two grains of 1 um, 10 um apart, approach at 5 m/s each.

    In 1 us, the shortest default step, they would pass each other undetected. With shorter steps they
    collide.
    """
    apart, speed = [[0, 0, 0], [1e-5, 0, 0]], [[5.0, 0, 0], [-5.0, 0, 0]]
    common = {"radius": 1e-6, "duration": 2e-6}
    meeting = scene(apart, speed, (Impact(hardness=1e5),), stepper=Verlet(), **common)
    rule = r"so short that no particle moves by more than the smallest radius, 1e-06 m, in it at 5 m/s"
    with pytest.raises(InputError, match=rf"^stepper\.control\.shortest must be {rule}; received 1e-06$"):
        run([meeting])
    shorter = Verlet(control=ApproachTime(shortest=1e-9, longest=1e-6))
    (result,) = run([meeting.model_copy(update={"stepper": shorter})])
    assert result.work["impacts"] == 1
    # If all grains move alike they do not meet, and without impacts nothing can be missed.
    along = scene(apart, [[5.0, 0, 0]] * 2, (Impact(hardness=1e5),), stepper=Verlet(), **common)
    free = scene(apart, speed, (), stepper=Verlet(), **common)
    assert all(result.status.ok for result in (*run([along]), *run([free])))
    beyond = scene(apart, [[1e155, 0, 0], [0, 0, 0]], (Impact(hardness=1e5),), stepper=Verlet(), **common)
    with pytest.raises(InputError, match=r"^stepper\.control\.shortest must be so short"):
        run([beyond])
