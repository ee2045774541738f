"""A failed world returns the state of its last good step, however often the states are read."""

import numpy as np
import pytest

from tests.compare import same_result
from tests.operators.test_filling import StickingSpring
from tests.scenes import compiled, fixed, scene
from tisim import Simulation
from tisim.backend.taichi import ti
from tisim.effects import Force, Gravity, Impact, parameter
from tisim.engine import monitor
from tisim.engine.checkpoint import restore, save
from tisim.operators import AddsParticles
from tisim.steppers import Brownian, DriftLimit, IterationControl, Trapezoid

WHEN = 0.783
"""Time of the failure, s."""


class Stiffening(Force):
    """A spring towards the centre that becomes stiffer at a given time, by any factor."""

    when: float = parameter("s", "when", WHEN)
    stiffness: float = parameter("N/m", "stiffness", 1.0)
    later: float = parameter("N/m", "later", 1.0)

    @ti.func
    def force(self, s, w, i, t):
        return ti.select(t > self.when(w), -self.later(w), -self.stiffness(w)) * s.position[w, i]


def one(stepper, **options):
    return scene(
        [[1.0, 0, 0]], [[0.0, 1, 0]], (Stiffening(**options),), mass=[1.0], stepper=stepper, duration=1.0
    )


def not_finite():
    """A stiffness of 1e308 N/m overflows within a step."""
    return one(fixed(1e-4), later=1e308), 1e-4, "is not finite"


def stuck():
    """The longest step, which is also the shortest, is too long for the spring."""
    control = IterationControl(first=1e-3, longest=1e-3, shortest=1e-3)
    return one(Trapezoid(control=control), later=1e9), 1e-3, "cannot be solved even at the shortest step"


def steep():
    """A force would move a Brownian particle too far even in the shortest step."""
    control = DriftLimit(longest=1e-4, shortest=1e-5)
    stepper = Brownian(temperature=300.0, viscosity=1e-3, control=control)
    return one(stepper, stiffness=1e-9, later=1e9), 1e-4, "shorter than the shortest"


def crowded():
    """Sixty grains that all come within interaction range of each other at the same time."""
    place = np.random.default_rng(3).normal(size=(60, 3))
    place /= np.linalg.norm(place, axis=1)[:, None]
    radius = 1e-3
    speed = (1.0 - 0.9 * radius) / 0.78
    setup = scene(place, -speed * place, (Impact(hardness=1e30),), radius=radius, dt=1e-2, duration=1.0)
    return setup, 1e-2, "more simultaneous contacts"


@pytest.mark.parametrize(
    "make",
    [
        not_finite,
        pytest.param(stuck, marks=pytest.mark.slow),
        pytest.param(steep, marks=pytest.mark.slow),
        pytest.param(crowded, marks=pytest.mark.slow),
    ],
)
def test_the_state_is_from_the_last_step_before_the_failure(make, monkeypatch):
    """This includes large systems, which are checked on the device."""
    start, step, fault = make()
    simulation = compiled(start, worlds=4)
    failures = []
    for stretches, large in ((1, monitor.LARGE), (7, 1)):
        monkeypatch.setattr(monitor, "LARGE", large)
        simulation.load([start, start.replace({"duration": WHEN / 2})])
        assert (simulation.monitor.finite_check is not None) == (large == 1)
        for _ in range(stretches):
            simulation.run(steps=None if stretches == 1 else 2000)
        bad, good = simulation.results()
        assert good.status.ok
        assert not bad.status.ok
        assert fault in bad.status.reason
        when, until = (
            float(part.split("t = ")[1].split(" s")[0]) for part in bad.status.reason.split("kept")
        )
        assert until == pytest.approx(bad.time, rel=1e-5)
        assert bad.time <= when <= bad.time + 1.001 * step
        failures.append(bad)
    assert failures[0].status == failures[1].status
    for name, values in failures[0].state.items():
        np.testing.assert_array_equal(values, failures[1].state[name])
    # A run that stops there on its own has the same state, and its next step fails.
    simulation.load([start])
    simulation.run(steps=failures[0].work["steps"])
    (there,) = simulation.results()
    assert there.time == failures[0].time
    for name, values in there.state.items():
        np.testing.assert_array_equal(values, failures[0].state[name])
    assert simulation.fraction() < 1
    simulation.run(steps=1)
    assert simulation.results()[0].status == failures[0].status


def several():
    """Worlds of 300 steps: three fail, in step 1, 110 and 200, and one does not."""
    return [
        one(fixed(1e-4), when=when, later=1e308).replace({"duration": 0.03})
        for when in (0.02, -1.0, 1.0, 0.011)
    ]


@pytest.fixture(params=[None, pytest.param("particle", marks=pytest.mark.slow)])
def batch(request):
    """A compiled simulation, the scenes of ``several``, and the result of each scene run alone."""
    scenes = several()
    simulation = compiled(scenes[0], worlds=4, schedule=request.param)
    alone = []
    for each in scenes:
        simulation.load([each])
        simulation.run()
        alone += simulation.results()
    assert [result.status.ok for result in alone] == [False, False, True, False]
    assert [result.work["steps"] for result in alone] == pytest.approx([200, 0, 300, 110], abs=1)
    return simulation, scenes, alone


@pytest.mark.parametrize("stretch", [300, 7])
def test_worlds_that_fail_in_one_batch_end_as_they_do_alone(batch, stretch):
    """Both with one run in which all of them fail, and with several short ones."""
    simulation, scenes, alone = batch
    simulation.load(scenes)
    while simulation.fraction() < 1:
        simulation.run(steps=stretch)
    for result, expected in zip(simulation.results(), alone, strict=True):
        same_result(result, expected)


def test_worlds_that_fail_together_are_rerun_together(batch, monkeypatch):
    """The steps from the start to the last failure are repeated only once, for any number of failed
    worlds."""
    simulation, scenes, _ = batch
    launched, advance = [], simulation.program.advance

    def counted(steps):
        launched.append(steps)
        advance(steps)

    monkeypatch.setattr(simulation.program, "advance", counted)
    counts = []
    for worlds in (scenes[:1], scenes):
        simulation.load(worlds)
        launched.clear()
        simulation.run(steps=250)
        counts.append(list(launched))
    assert set(counts[0]) <= set(counts[1])
    assert all(sum(count[1:]) <= 2 * 250 for count in counts)


def test_ctrl_c_during_the_rerun_leaves_the_batch_unchanged(batch, monkeypatch):
    """A run that continues afterwards reaches the same end."""
    simulation, scenes, alone = batch
    simulation.load(scenes)
    reached, advance = [], simulation.program.advance

    def stopped(steps):
        if reached:
            raise KeyboardInterrupt
        advance(steps)
        reached.append(simulation.s.read("steps"))

    monkeypatch.setattr(simulation.program, "advance", stopped)
    with pytest.raises(KeyboardInterrupt):
        simulation.run(steps=250)
    monkeypatch.undo()
    np.testing.assert_array_equal(simulation.s.read("steps"), reached[0])
    simulation.run()
    for result, expected in zip(simulation.results(), alone, strict=True):
        same_result(result, expected)


@pytest.mark.parametrize("steps", [150, 250])
def test_a_checkpoint_keeps_the_reasons_of_failures(batch, tmp_path, steps):
    simulation, scenes, alone = batch
    simulation.load(scenes)
    simulation.run(steps=steps)
    before = simulation.results()
    assert sum("kept t =" in result.status.reason for result in before) == (2 if steps == 150 else 3)
    save(simulation, tmp_path / "c.h5")
    simulation.load(scenes)
    restore(simulation, tmp_path / "c.h5")
    for result, expected in zip(simulation.results(), before, strict=True):
        same_result(result, expected)
    simulation.run()
    for result, expected in zip(simulation.results(), alone, strict=True):
        same_result(result, expected)


class Doubles(AddsParticles):
    """After five steps, inserts a grain where there already is one."""

    @ti.func
    def world(self, s, w):
        if s.steps[w] > 5:
            s.append(w, 0)

    def capacity(self, masses):
        return len(masses) + 8


@pytest.mark.slow
def test_a_failure_after_events_keeps_whole_steps():
    """In that case forces are evaluated within a step; the kept state still continues with whole steps."""
    place, speed = [[0, 0, 0], [0, 0, 1.9e-3], [0, 0.1, 0]], [[0.1, 0, 0], [0, 0, 0], [0, 0, 0]]
    effects = (StickingSpring(), Gravity(acceleration=(0, 0, -9.81)), Doubles())
    setup = scene(place, speed, effects, stepper=fixed(1e-3), duration=0.02)
    simulation = Simulation(setup, capacity=16)
    simulation.load(setup)
    simulation.run(steps=5)
    (good,) = simulation.results()
    simulation.load(setup)
    simulation.run()
    (failed,) = simulation.results()
    simulation.close()
    assert not failed.status.ok
    assert failed.time == good.time
    for name in ("position", "velocity"):
        np.testing.assert_array_equal(failed.state[name], good.state[name])
