"""Free particles move along straight lines, for any time from 1e-15 to 1e3 times the longest step."""

import numpy as np
import pytest

from tests.scenes import compiled, roundoff, scene, simulate
from tisim import Particles, Recording, Scene
from tisim.effects import NearField
from tisim.io.reader import frames
from tisim.sources import UniformFlow
from tisim.steppers import (
    ApproachTime,
    Boris,
    Brownian,
    Collocation,
    DriftLimit,
    ErrorControl,
    FixedStep,
    IterationControl,
    StageControl,
    Trapezoid,
    Verlet,
)

PARTICLES = 9
"""One more than a vector on a CPU holds."""
NOTHING = NearField(alpha1=0.0, alpha2=0.0)
"""A pair force, for which all particles take common steps."""
FREE = {
    "verlet, fixed": lambda longest: Verlet(control=FixedStep(dt=longest)),
    "verlet, approach": lambda longest: Verlet(
        control=ApproachTime(shortest=1e-3 * longest, longest=longest)
    ),
    "boris": lambda longest: Boris(control=FixedStep(dt=longest)),
    "trapezoid, iteration": lambda longest: Trapezoid(control=IterationControl(**limits(longest))),
    "trapezoid, error": lambda longest: Trapezoid(control=ErrorControl(**limits(longest))),
    "collocation": lambda longest: Collocation(control=StageControl(**limits(longest))),
}
QUICK = ["verlet, fixed", "trapezoid, iteration", "brownian"]
ALL = [
    (name, together, schedule)
    for name in (*FREE, "brownian")
    for together in (False, True)
    for schedule in ("world", "particle")
]
CASES = [
    pytest.param(*case, marks=pytest.mark.long)
    if case[0] in QUICK and case[1:] == (False, "world")
    else pytest.param(*case, marks=pytest.mark.slow)
    for case in ALL
]
DECADES = 10.0 ** np.arange(-15, 4)
NEAR = np.array([1.0, 1 - 1e-12, 1 + 1e-12, 1 - 1e-7, 1 + 1e-7, 1 + 3e-6])
"""Includes slightly less and more than a whole number of steps."""
RATIOS = np.unique(np.concatenate([DECADES, NEAR, 3 * NEAR, 1e-6 * NEAR, DECADES * np.pi / 2]))
LONGEST = np.array([2.0**-12, 1e3])
"""Longest steps (s), a small one and a large one, both exact in single precision."""
WORLDS = len(RATIOS) * len(LONGEST)


def limits(longest):
    return {"first": 0.04 * longest, "longest": longest, "shortest": 1e-9 * longest}


def straight(name, together, longest, ratio):
    """Particles in a row that move across it; colloids move with a flow."""
    place, velocity = np.zeros((PARTICLES, 3)), np.zeros((PARTICLES, 3))
    place[:, 0] = 10.0 * np.arange(PARTICLES)
    velocity[:, 1:] = [1e6, -3.0] if name == "brownian" else np.random.default_rng(1).normal(size=(9, 2))
    effects, duration = (NOTHING,) if together else (), ratio * longest
    if name != "brownian":
        return scene(place, velocity, effects, stepper=FREE[name](longest), duration=duration)
    control = DriftLimit(longest=longest, shortest=1e-8 * longest)
    return Scene(
        particles=Particles(position=place, velocity=velocity, radius=1e-3, density=1.0),
        effects=(*effects, UniformFlow(velocity=tuple(velocity[0]))),
        stepper=Brownian(temperature=0.0, viscosity=1.0, control=control),
        duration=duration,
    )


def on_line(arrays, start, time):
    """Check that particles have the right positions after a time (s)."""
    rounding = roundoff()
    order = np.argsort(arrays["id"])
    gone = arrays["position"][order][:, 1:]
    np.testing.assert_allclose(gone, start["velocity"][:, 1:] * time, rtol=1e4 * rounding)


@pytest.mark.parametrize(("name", "together", "schedule"), CASES)
def test_straight_lines(name, together, schedule):
    """For any duration there is at least one step, the time is exact to the last bit, and the position to
    rounding."""
    scenes = [straight(name, together, longest, ratio) for longest in LONGEST for ratio in RATIOS]
    for result in simulate(scenes, worlds=WORLDS, capacity=PARTICLES, schedule=schedule):
        assert result.status.ok, result.status.reason
        assert result.time == result.scene.duration
        assert result.work["steps"] > 0
        assert result.work["particle_steps"] >= PARTICLES
        on_line(result.state, result.start, result.time)


def short(scenes):
    """Results of scenes without effects, in a simulation that is already compiled."""
    return simulate(scenes, worlds=WORLDS, capacity=PARTICLES, schedule="world")


def test_a_very_short_run_with_the_default_stepper():
    """A picosecond at 1e6 m/s, with default limits."""
    (result,) = short([scene([[0.0] * 3], [[1e6, 0, 0]], stepper=Trapezoid(), duration=1e-12)])
    assert result.state["position"][0, 0] == 1e-6
    assert result.work["particle_steps"] == 1


def test_growth_of_steps_is_counted():
    """Steps that double from 1 s need ten for 1023 s, and slightly more if limited to 100 s."""
    control = IterationControl(first=1.0, longest=2e3, most=2.0)
    assert control.min_steps(1023.0) == pytest.approx(10.0)
    (result,) = short([scene([[0.0] * 3], [[1.0] * 3], stepper=Trapezoid(control=control), duration=1023.0)])
    assert result.work["particle_steps"] == 10
    assert IterationControl(first=1.0, longest=100.0, most=2.0).min_steps(1023.0) == pytest.approx(10.23)


def test_remaining_steps():
    """The number of steps left at the length of the last one, in the world that has most."""
    scenes = [
        scene([[0.0] * 3], [[1.0] * 3], stepper=FREE["verlet, fixed"](dt), duration=1.0)
        for dt in (1e-2, 1e-3)
    ]
    simulation = compiled(scenes[0], WORLDS, PARTICLES, "world")
    simulation.load(scenes)
    assert simulation.remaining_steps() == pytest.approx(1000, abs=1)
    simulation.run(steps=40)
    assert simulation.remaining_steps() == pytest.approx(960, abs=1)
    simulation.run()
    assert simulation.remaining_steps() == 0


@pytest.mark.long
@pytest.mark.parametrize("name", ["trapezoid, iteration", "brownian"])
def test_frames_near_the_times_of_synchronisation(name, tmp_path):
    """Particles synchronise at multiples of the longest step, and frames are due just before and after them.

    Each frame shows consistent positions, none comes too early, and the end is the same to the last bit.
    """
    ratios = np.array([1e-9, 1e-6, 0.3, 1.0, 1 + 1e-7, 7.0, 7 - 1e-7])
    scenes = [straight(name, False, LONGEST[0], ratio) for ratio in ratios]
    alone = simulate(scenes, worlds=WORLDS, capacity=PARTICLES, schedule="world")
    simulation = compiled(scenes[0], WORLDS, PARTICLES, "world")
    for every in LONGEST[0] * np.array([1e-3, 1 - 1e-7, 1 - 1e-12, 1.0, 1 + 1e-12, 1 + 1e-7, 2.5]):
        path = tmp_path / f"{every}.h5"
        simulation.load(scenes)
        with Recording(path, every=every).observer(simulation) as recorder:
            simulation.run(observers=[recorder])
        for w, (result, other) in enumerate(zip(simulation.results(), alone, strict=True)):
            np.testing.assert_array_equal(result.state["position"], other.state["position"])
            with frames(path, w) as sequence:
                times = []
                for frame in sequence:
                    times.append(frame.time)
                    on_line(frame.arrays, result.start, frame.time)
            assert times[0] == 0.0
            assert times[-1] == result.time
            # One frame for each time asked for, at the next synchronisation or at the end.
            meetings = np.append(
                np.arange(np.ceil(result.time / LONGEST[0] - 1e-6)) * LONGEST[0], result.time
            )
            frame_times = np.arange(np.floor(result.time / every) + 1) * every
            due = np.searchsorted(meetings, frame_times * (1 - 1e-8))
            assert set(meetings[np.minimum(due, len(meetings) - 1)]) <= set(times)
