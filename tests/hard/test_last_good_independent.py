"""Non-interacting particles with a longest step equal to the run: the state returned if one fails during the
run, and the state at which the next launch continues if a launch ends within a step."""

from itertools import islice

import numpy as np
import pytest

from tests.compare import same_result
from tests.scenes import compiled, scene
from tisim import Particles, Scene, Simulation
from tisim.backend.taichi import ti
from tisim.effects import Force, parameter
from tisim.engine.checkpoint import restore, save
from tisim.sources import UniformFlow
from tisim.steppers import Brownian, DriftLimit, IterationControl, Trapezoid, intervals

SPEED = np.resize([1.0, 0.5, 0.25], 10)
"""Speeds (m/s): some particles reach the cliff at 0.783 s, others never. There are more than fit in one
tile."""
CLIFF = 0.783
STEP = 1e-3
"""Step (s) far from the cliff."""


class Ledge(Force):
    """A force across the path and, beyond a position along x, a spring that is far too stiff."""

    place: float = parameter("m", "place")
    push: float = parameter("N", "push", 0.0)

    @ti.func
    def force(self, s, w, i, t):
        beyond = ti.max(s.position[w, i][0] - self.place(w), 0.0)
        return ti.Vector([-1e13 * beyond, self.push(w) + 0.0 * beyond, 0.0 * beyond])


def inert(place=CLIFF, step=STEP, duration=1.0):
    """Inertial particles with steps that do not grow."""
    control = IterationControl(first=step, longest=1.0, shortest=1e-2 * step, most=1.0)
    start = np.zeros((len(SPEED), 3)), np.outer(SPEED, [1.0, 0, 0])
    return scene(
        *start, (Ledge(place=place),), mass=1.0, stepper=Trapezoid(control=control), duration=duration
    )


def drifting(place=CLIFF, step=STEP, duration=1.0):
    """Athermal colloids carried by a flow and pushed across it at 1 m/s; each step is as long as the drift
    allows."""
    control = DriftLimit(longest=1.0, shortest=max(1e-6 * step, 1e-9), drift=step)
    return Scene(
        particles=Particles(
            position=np.outer(SPEED - 1.0, [1.0, 0, 0]), velocity=0.0 * np.outer(SPEED, [1.0, 0, 0]),
            radius=1.0, density=1.0,
        ),
        effects=(Ledge(place=place, push=1.0), UniformFlow(velocity=(1.0, 0.0, 0.0))),
        stepper=Brownian(temperature=0.0, viscosity=1 / (6 * np.pi), control=control),
        duration=duration,
    )  # fmt: skip


def velocities(setup):
    """Velocities before the cliff, m/s."""
    ahead = SPEED if isinstance(setup.stepper, Trapezoid) else np.ones(len(SPEED))
    return np.outer(ahead, [1.0, 0, 0]) + np.array([0.0, setup.effects[0].push, 0.0])


BOTH = pytest.mark.parametrize("make", [inert, pytest.param(drifting, marks=pytest.mark.slow)])


def in_launches(setup, monkeypatch, attempts):
    """A simulation in which each launch makes ``attempts`` step attempts for a particle."""
    monkeypatch.setattr(intervals, "LAUNCH_ATTEMPTS", 1)
    monkeypatch.setattr(intervals, "LEAST_INTERVALS", attempts)
    return Simulation(setup, worlds=2)


@BOTH
def test_the_state_is_from_the_last_step_of_the_failing_particle(make, tmp_path):
    """All particles are returned at that time; a run that continues from there fails at once."""
    fails, ends = make(), make(duration=CLIFF / 2)
    simulation = compiled(fails, worlds=2, capacity=len(SPEED))
    simulation.load([fails, ends])
    simulation.run()
    bad, good = simulation.results()
    assert good.status.ok
    assert not bad.status.ok
    assert bad.time == pytest.approx(CLIFF, abs=2 * STEP)
    fault, kept_time = (
        float(part.split("t = ")[1].split(" s")[0]) for part in bad.status.reason.split("kept")
    )
    assert fault == kept_time == pytest.approx(bad.time, rel=1e-5)
    assert "by effects.ledge" in bad.status.reason
    assert "at particle 0" in bad.status.reason
    way, free = bad.state["position"] - bad.start["position"], velocities(fails) * bad.time
    np.testing.assert_allclose(way, free, atol=1e-2 * STEP)
    there = bad.state["position"][:, 0] > CLIFF - 1e-2 * STEP
    assert there.sum() == 4
    np.testing.assert_allclose(way[~there], free[~there], rtol=1e-12)
    assert bad.work["particle_steps"] == pytest.approx(len(SPEED) * bad.time / STEP, rel=0.2)
    save(simulation, tmp_path / "c.h5")
    simulation.load([fails, ends])
    restore(simulation, tmp_path / "c.h5")
    for result, expected in zip(simulation.results(), (bad, good), strict=True):
        same_result(result, expected)


@pytest.mark.long
@BOTH
def test_launches_that_end_within_a_step(make, monkeypatch, tmp_path):
    """Launches end every 64 steps of a particle, and the run is saved and restored there.

    Checked are the progress, the last state common to all particles, and identical bits at the end, for a
    failing and for a good world.
    """
    fails, ends = make(), make(place=5.0)
    whole = compiled(fails, worlds=2, capacity=len(SPEED))
    whole.load([fails, ends])
    whole.run()
    expected = whole.results()
    assert [result.status.ok for result in expected] == [False, True]
    simulation = in_launches(fails, monkeypatch, 64)
    simulation.load([fails, ends])
    fractions = []
    for _ in islice(simulation.chunks(), 1, None):
        fractions.append(simulation.fraction())
        ended = simulation.s.read("underway")[1] == 0
        assert simulation.results()[1].time == (1.0 if ended else 0.0)
        if len(fractions) in (3, 9):
            save(simulation, tmp_path / "c.h5")
            before = simulation.results()
            simulation.load([fails, ends])
            restore(simulation, tmp_path / "c.h5")
            for result, other in zip(simulation.results(), before, strict=True):
                same_result(result, other)
            assert simulation.fraction() == fractions[-1]
    assert len(fractions) > 10
    assert (np.diff(fractions) > 0).all()
    assert fractions[-1] == 1
    for result, other in zip(simulation.results(), expected, strict=True):
        same_result(result, other)


@BOTH
def test_the_steps_of_a_launch_are_limited(make):
    """The limit counts the steps of all particles, so Ctrl-C and progress work within a run of one longest
    step."""
    long = make(step=1e-7, place=5.0)
    simulation = compiled(long, worlds=2, capacity=len(SPEED))
    simulation.load([long])
    list(islice(simulation.chunks(), 2))
    steps = simulation.s.read("particle_steps")[0]
    assert 0.1 * intervals.LAUNCH_ATTEMPTS < steps <= intervals.LAUNCH_ATTEMPTS
    assert simulation.fraction() == pytest.approx(steps / (1e7 * len(SPEED)), rel=1e-3)
