"""Single precision: displacements below the last digit of a position add up, and steps are counted
exactly."""

import numpy as np
import pytest

import tisim
from tisim import effects as laws
from tisim.engine.loading import check_rounding
from tisim.steppers import (
    Boris,
    Collocation,
    ErrorControl,
    FixedStep,
    IterationControl,
    StageControl,
    Trapezoid,
    Verlet,
)

pytestmark = pytest.mark.long

SPEED, DT, STEPS = 1e-3, 1e-5, 200_000
STEPPERS = {
    "verlet": lambda dt: Verlet(control=FixedStep(dt=dt)),
    "boris": lambda dt: Boris(control=FixedStep(dt=dt)),
}


def flights():
    """Return the final position of a slow particle and its number of steps, for each stepper.

    One step moves it by 1.3 units in the last place at 0.1 m, and by a sixth of one at 1 m.
    """
    ends = {}
    for name, stepper in STEPPERS.items():
        scene = tisim.Scene(
            particles=tisim.Particles(
                position=[(0.1, 1.0, -0.1)], velocity=[(SPEED, SPEED, -SPEED)], radius=1e-3, density=2500.0
            ),
            effects=(laws.Gravity(acceleration=(0, 0, 0)),),
            stepper=stepper(DT),
            duration=STEPS * DT,
        )
        (result,) = tisim.run([scene])
        ends[name] = result.state["position"][0].tolist(), result.work["steps"]
    return ends


def counts():
    """Return the numbers of Verlet steps taken for given numbers of steps."""
    scenes = [
        tisim.Scene(
            particles=tisim.Particles(position=[(0, 0, 0)], velocity=[(1, 0, 0)], radius=1e-3, density=1.0),
            stepper=Verlet(control=FixedStep(dt=dt)),
            duration=number * dt,
        )
        for number in (1, 7, 2000, 100_001)
        for dt in (1e-5, 3e-7, 0.1)
    ]
    return [result.work["steps"] for result in tisim.run(scenes)]


def fast_flights():
    """Return the result of ``flights`` in fast arithmetic, which may regroup sums."""
    tisim.init(precision="f32", arithmetic="fast")
    return flights()


@pytest.fixture(scope="module")
def measured(single):
    """The result of ``everything`` from one process of single precision."""
    return single("steppers.test_single_precision", "everything")


def right_distance(ends):
    """Assert that particles of ``flights`` have moved by the exact distance in the exact number of steps."""
    for place, steps in ends.values():
        assert steps == STEPS
        exact = np.array([0.1, 1.0, -0.1]) + SPEED * DT * STEPS * np.array([1, 1, -1])
        assert np.abs(np.array(place) - exact).max() < 2e-7


def test_a_slow_particle_moves_the_right_distance(measured):
    right_distance(measured["flights"])


@pytest.mark.slow
def test_a_slow_particle_moves_the_right_distance_in_fast_arithmetic(single):
    right_distance(single("steppers.test_single_precision", "fast_flights"))


def test_the_requested_number_of_steps_is_taken(measured):
    assert measured["counts"] == [n for n in (1, 7, 2000, 100_001) for _ in "abc"]


def restarts():
    """Return whether a run restarted from its checkpoint ends with the same bits."""
    import tempfile
    from pathlib import Path

    from tisim.engine.checkpoint import restore, save

    scene = tisim.Scene(
        particles=tisim.Particles(
            position=[(0.1, 0, 0.5)], velocity=[(1e-3, 0, 0)], radius=1e-3, density=1.0
        ),
        effects=(laws.Gravity(acceleration=(0, 0, -1e-3)),),
        stepper=Verlet(control=FixedStep(dt=1e-5)),
        duration=0.02,
    )
    simulation = tisim.Simulation(scene)
    simulation.load(scene)
    simulation.run(steps=900)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "c.h5"
        save(simulation, path)
        simulation.run()
        straight = simulation.results()[0].state["position"].tolist()
        restore(simulation, path)
        simulation.run()
    return straight == simulation.results()[0].state["position"].tolist()


def test_a_checkpoint_includes_rounding_remainders(measured):
    assert measured["restarts"]


ASKED = {
    "scene.accuracy": {"accuracy": 1e-5},
    "stages": {"stepper": Collocation(control=StageControl(error=1e-7))},
    "tolerance": {"stepper": Trapezoid(control=IterationControl(tolerance=1e-9))},
    "the default": {},
    "fine enough": {"stepper": Trapezoid(control=ErrorControl(error=1e-6, tolerance=1e-6))},
}


def refusals():
    """Return the message for each requested error, empty if it is accepted."""
    said = {}
    for name, asked in ASKED.items():
        scene = tisim.Scene(
            particles=tisim.Particles(position=[(0, 0, 0)], velocity=[(1, 0, 0)], radius=1e-3, mass=1e-3),
            effects=(laws.Tether(stiffness=(1e3,) * 3),),
            duration=1e-3,
            **asked,
        )
        try:
            check_rounding(scene)
            said[name] = ""
        except tisim.InputError as refused:
            said[name] = str(refused)
    with pytest.raises(tisim.InputError, match=r"at least 1e-06 in f32"):
        # A run makes this check before it starts.
        tisim.run(scene.model_copy(update=ASKED["tolerance"]))
    return said


def everything():
    """Results of the functions above, by their names."""
    return {function.__name__: function() for function in (flights, counts, restarts, refusals)}


def test_unreachable_errors_are_refused(measured):
    rule = "must be at least {} in f32, which rounds positions by 1.2e-07; received {}"
    assert measured["refusals"] == {
        "scene.accuracy": f"scene.accuracy {rule.format('2e-05', '1e-05')}",
        "stages": f"stepper.control.error {rule.format('1e-06', '1e-07')}",
        "tolerance": f"stepper.control.tolerance {rule.format('1e-06', '1e-09')}",
        **dict.fromkeys(("the default", "fine enough"), ""),
    }
