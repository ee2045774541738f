"""Non-interacting particles with individual steps, in launches of any length."""

import numpy as np
import pytest

from tests.scenes import compiled, scene
from tests.steppers.charged import accurate, charged
from tisim.backend.taichi import ti
from tisim.components.component import parameter
from tisim.effects import Force
from tisim.engine.checkpoint import restore, save
from tisim.steppers import IterationControl, Trapezoid

DRIVEN = {"stiffness": 8.0, "amplitude": 1.5, "omega": 2.0}


class Cliff(Force):
    """No force, but beyond a place along x a spring that is far too stiff."""

    place: float = parameter("m", "place")

    @ti.func
    def force(self, s, w, i, t):
        beyond = ti.max(s.position[w, i][0] - self.place(w), 0.0)
        return ti.Vector([-1e13 * beyond, 0.0 * beyond, 0.0 * beyond])


@pytest.mark.parametrize("chunks", [[], [1, 1, 5]])
def test_the_first_stuck_particle_is_named_with_time_and_force(chunks):
    """Two particles reach the cliff at 0.5 and 0.3 s; the second is named for any order in which launches
    reach them.

    Other particles and worlds do not matter, and the kept state is finite.
    """
    control = IterationControl(first=1e-4, longest=1e-4, shortest=1e-5, tolerance=1e-6)
    start = ([[0.0, 0, 0], [0.2, 1, 0], [0.0, 2, 0]], [[1.0, 0, 0], [1.0, 0, 0], [-1.0, 0, 0]])
    falling, free = (
        scene(*start, (Cliff(place=place),), mass=1.0, stepper=Trapezoid(control=control), duration=1.0)
        for place in (0.5, 5.0)
    )
    simulation = compiled(falling, worlds=2, capacity=3)
    simulation.load([falling, free])
    for steps in chunks:
        simulation.run(steps=steps)
    assert simulation.results()[0].work["steps"] == sum(chunks)
    simulation.run()
    stuck, fine = simulation.results()
    assert fine.status.ok
    assert "at particle 1" in stuck.status.reason
    assert "by effects.cliff" in stuck.status.reason
    fault_time = float(stuck.status.reason.split("t = ")[1].split(" s")[0])
    assert fault_time == pytest.approx(0.3, abs=2e-4)
    kept_time = float(stuck.status.reason.rsplit("t = ", 1)[1].split(" s")[0])
    assert kept_time <= fault_time
    assert np.isfinite(stuck.state["position"]).all()


def test_steps_below_the_rounding_of_time_are_not_taken():
    """At the cliff the particle needs steps of 3e-7 s, but the final time is rounded to 1e-6 s.

    The world stops with a message. With steps of 1e-20 s it would never reach the end.
    """
    control = IterationControl(first=1e-20, longest=1e-3, shortest=1e-25)
    stepper, start = Trapezoid(control=control), ([[0.0, 0, 0]], [[1.0, 0, 0]])
    setup = scene(*start, (Cliff(place=0.0),), mass=1.0, stepper=stepper, duration=1e10)
    simulation = compiled(setup, worlds=2, capacity=3)
    simulation.load([setup])
    simulation.run(steps=1)
    (result,) = simulation.results()
    assert "cannot be solved even at the shortest step, by effects.cliff" in result.status.reason
    assert result.time == 0.0


def test_remaining_steps_count_windows_not_launches():
    """There are 10000 windows of 1e-4 s, of which two are run first, and then a thousand."""
    control = IterationControl(first=1e-4, longest=1e-4, shortest=1e-5, tolerance=1e-6)
    start = ([[0.0, 0, 0]], [[1.0, 0, 0]])
    setup = scene(*start, (Cliff(place=5.0),), mass=1.0, stepper=Trapezoid(control=control), duration=1.0)
    simulation = compiled(setup, worlds=2, capacity=3)
    simulation.load([setup])
    for steps, ahead in ((2, 9998), (1000, 8998)):
        simulation.run(steps=steps)
        assert simulation.remaining_steps() == pytest.approx(ahead, abs=1)


@pytest.mark.slow
def test_requested_steps_are_taken_and_checkpoints_keep_all_bits(tmp_path):
    """A step of the world is a window; one launch, small ones, and a checkpoint give the same bits."""
    setup = charged(accurate(1e-5, longest=1e-2), 2.0, **DRIVEN)
    simulation = compiled(setup, capacity=1)

    def run(*portions):
        simulation.load([setup])
        for steps in portions:
            simulation.run(steps=steps)
        step_count = simulation.results()[0].work["steps"]
        assert step_count == sum(portions)
        return step_count

    def end():
        simulation.run()
        (result,) = simulation.results()
        return result.state, result.work, result.time

    run()
    whole, work, time = end()
    assert work["steps"] == 200
    assert work["particle_steps"] > 500
    assert time == 2.0
    ends = []
    run(1, 2, 70)
    save(simulation, tmp_path / "c.h5")
    ends.append(end())
    simulation.load([setup])
    restore(simulation, tmp_path / "c.h5")
    ends.append(end())
    for state, counts, when in ends:
        assert counts == work
        assert when == time
        for name, values in state.items():
            np.testing.assert_array_equal(values, whole[name], err_msg=name)
