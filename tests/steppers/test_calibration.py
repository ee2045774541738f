"""Ratio of the final error to the requested one: bounds over scenes with known final states."""

import numpy as np
import pytest

from tests.scenes import compiled, simulate
from tests.steppers.calibrated import (
    CHAOTIC,
    CONTROLS,
    SINGLE,
    Single,
    collocation,
    orbit,
    ratios,
    trapezoid,
)
from tests.steppers.charged import order
from tisim import Box, Scene
from tisim.engine.checkpoint import restore, save
from tisim.steppers import ErrorControl, StageControl, Trapezoid
from tisim.steppers.implicit.stages import leading

ASKED = 10.0 ** -np.arange(2, 6)
FORGETS = "drag in a flow"
"""Its errors decay during the run."""
BAND = 1 / 20, 20.0
"""Bounds on this ratio for motions that neither damp nor amplify errors."""


def within(ratios_by_scene, least=BAND[0], most=BAND[1]):
    for name, values in ratios_by_scene.items():
        assert (values > (0.0 if name == FORGETS else least)).all(), f"{name}: {values}"
        assert (values < most).all(), f"{name}: {values}"


@pytest.mark.long
def test_the_final_error_of_a_single_particle_is_the_requested_one():
    """With the trapezoidal rule the ratio is within a factor of 4 for each linear motion and requested
    error."""
    ratios_by_scene = ratios(trapezoid("run"), ASKED, SINGLE)
    within(ratios_by_scene, 0.25, 4.0)
    assert list(ratios_by_scene) == list(SINGLE)


@pytest.mark.long
def test_particles_in_a_batch_and_from_a_checkpoint_have_the_same_bits(tmp_path):
    """The largest distance from the start is stored for each particle."""
    scenes = [calibrated.scene(trapezoid("run")(ASKED[0])) for calibrated in SINGLE.values()]
    worlds = len(SINGLE) * len(ASKED)
    together = simulate(scenes, worlds=worlds, capacity=1)
    simulation = compiled(scenes[0], worlds, 1)
    for scene, result in zip(scenes[::3], together[::3], strict=True):
        (alone,) = simulate([scene], worlds=worlds, capacity=1)
        assert alone.work == result.work
        np.testing.assert_array_equal(alone.state["position"], result.state["position"])
    # Windows of a tenth of a second, at which a run can stop.
    control = ErrorControl(error=1e-3, tolerance=1e-5, per="run", first=1e-4, longest=0.1)
    stops = scenes[0].model_copy(update={"stepper": Trapezoid(control=control)})
    simulation.load([stops])
    simulation.run()
    (whole,) = simulation.results()
    simulation.load([stops])
    simulation.run(steps=7)
    save(simulation, tmp_path / "c.h5")
    simulation.load([stops])
    restore(simulation, tmp_path / "c.h5")
    simulation.run()
    (rest,) = simulation.results()
    assert rest.work == whole.work
    np.testing.assert_array_equal(rest.state["position"], whole.state["position"])


def from_first_steps(tolerances):
    """Ratio of the final error to the requested one for an oscillator with collocation, for each first step
    (s)."""
    oscillator = {"oscillator": Single(3.25, (1.0, 0.0), spring=(2 * np.pi) ** 2)}
    makes = [collocation("run", first) for first in (1e-4, StageControl().first, 1e-8)]
    return [ratios(make, tolerances, oscillator)["oscillator"].tolist() for make in makes]


@pytest.mark.slow
def test_steps_are_solved_for_any_first_step():
    """In a very short first step a sweep changes nothing, which says nothing about longer steps.

    If it were taken as a contraction rate of 0, all later steps would be left unsolved, and the final error
    would be 20 times the requested one.
    """
    ratios_by_step = np.array(from_first_steps(10.0 ** -np.arange(7, 11)))
    assert (ratios_by_step > 0.25).all(), ratios_by_step
    assert (ratios_by_step < 1.0).all(), ratios_by_step


@pytest.mark.slow
def test_steps_are_solved_in_single_precision(single):
    """In single precision a sweep changes nothing in steps a thousand times as long."""
    within({"single precision": np.array(single("steppers.test_calibration", "few_digits"))}, 0.1, 1.0)


def few_digits():
    """For a separate process in single precision."""
    return from_first_steps(10.0 ** -np.arange(2, 6))


def test_the_leading_term_of_the_estimate():
    """With two stages it is the term of the trapezoidal rule: (k dt)^3/12 of the amplitude."""
    factor, power = leading(2)
    # The estimate with two stages is a/6 k dt, here divided by a.
    assert (factor * 0.3 / 6) ** power == pytest.approx(0.3 / 12)
    assert [leading(s)[1] for s in (2, 3, 5)] == [1.0, 1.5, 1.75]


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CONTROLS if "run" in name])
def test_the_final_error_is_the_requested_one(name):
    """The ratio is within a factor of 20 for every decade; the chaotic motion amplifies errors by about
    50."""
    make, tolerances = CONTROLS[name]
    ratios_by_scene = ratios(make, tolerances)
    within({scene: values for scene, values in ratios_by_scene.items() if scene != CHAOTIC})
    assert (ratios_by_scene[CHAOTIC] < 100).all(), ratios_by_scene[CHAOTIC]


@pytest.mark.slow
def test_the_final_error_with_the_default_first_step():
    """Collocation takes few steps and depends on their places, so the bound is a factor of 50 for these
    motions."""
    ratios_by_scene = ratios(
        collocation("run", StageControl().first), CONTROLS["Collocation, StageControl"][1]
    )
    within({scene: values for scene, values in ratios_by_scene.items() if scene != CHAOTIC}, 1 / 50, 50.0)
    assert (ratios_by_scene[CHAOTIC] < 100).all(), ratios_by_scene[CHAOTIC]


@pytest.mark.slow
def test_an_error_per_step_determines_the_final_error_less():
    """For the same motions the final error differs from the error requested for steps by factors above 100.

    The factor goes either way and depends on the requested error.
    """
    for name, (make, tolerances) in CONTROLS.items():
        if "run" not in name:
            values = np.concatenate(
                [v for scene, v in ratios(make, tolerances).items() if scene not in (CHAOTIC, FORGETS)]
            )
            assert max(values.max(), 1 / values.min()) > 100


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "tolerances", "expected"),
    [(trapezoid, ASKED, 2.0), (collocation, 10.0 ** -np.arange(4, 11), 8.0)],
)
def test_order_is_kept(make, tolerances, expected):
    """The error falls with the number of steps as for equal steps."""
    oscillator = Single(30.25, (1.0, 0.0), spring=(2 * np.pi) ** 2)
    results = simulate(
        [oscillator.scene(make("run")(e)) for e in tolerances], worlds=len(tolerances), capacity=1
    )
    errors = [oscillator.end.error(result) for result in results]
    steps = [result.work["particle_steps"] for result in results]
    assert order(steps, errors) == pytest.approx(expected, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("make", [trapezoid("run"), collocation("run")])
def test_the_size_of_a_motion_in_a_box_equals_open_space(make):
    """Two bodies in orbit through the faces of a periodic box take the same steps as in open space."""
    free = orbit(0.5, 1.3).scene(make(1e-4))
    results = []
    for shift in (0.0, 4.0):
        data = free.to_dict()
        places = np.array(data["particles"]["position"]) + shift
        data["particles"]["position"] = ((places + 4.0) % 8.0 - 4.0).tolist()
        boxed = Scene.from_dict(data).model_copy(update={"domain": Box(low=(-4.0,) * 3, high=(4.0,) * 3)})
        results += simulate([boxed], capacity=5)
    inside, across = results
    assert inside.status.ok
    assert across.status.ok
    assert across.work["steps"] == pytest.approx(inside.work["steps"], abs=2)
    moved = across.state["position"] - inside.state["position"] - 4.0
    np.testing.assert_allclose((moved + 4.0) % 8.0 - 4.0, 0.0, atol=1e-6)
