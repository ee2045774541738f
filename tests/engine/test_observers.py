"""Partial runs, and observers called during them."""

import numpy as np
import pytest

from tests.compare import same_results
from tests.scenes import compiled, flow
from tisim import InputError, Observer, PeriodicCheckpoint

FLOWS = [flow(0, grains=60, surface_energy=1e3), flow(1, grains=60, duration=4e-4, surface_energy=1e3)]
CAPACITY = max(scene.capacity() for scene in FLOWS)


@pytest.fixture
def simulation():
    scene = compiled(FLOWS[0], 2, CAPACITY)
    scene.load(FLOWS)
    return scene


@pytest.fixture(scope="module")
def whole():
    """Results of a run in one go, and the end times of all steps of each world, s."""
    sim = compiled(FLOWS[0], 2, CAPACITY)
    sim.load(FLOWS)
    times = [sim.s.read("time")]
    while len(sim.ended()) < 2:
        sim.run(steps=1)
        times.append(sim.s.read("time"))
    sim.load(FLOWS)
    sim.run()
    return sim.results(), np.array(times).T


def first_end(times, pause):
    """The first of these times at or after ``pause``; the last if there is none."""
    return times[min(np.searchsorted(times, pause), len(times) - 1)]


class Waits(Observer):
    """Makes each world wait at given times, and records the times at which it observes."""

    def __init__(self, *pauses):
        self.pauses, self.observed = [list(times) for times in pauses], []

    def pause(self, simulation):
        return np.array([min(times, default=np.inf) for times in self.pauses])

    def observe(self, simulation):
        now = simulation.s.read("time")
        self.observed.append(now)
        self.pauses = [[t for t in times if t > now[w]] for w, times in enumerate(self.pauses)]


def test_until_stops_at_the_next_step_end_and_runs_continue(simulation, whole):
    results, times = whole
    simulation.run(until=2e-4)
    assert [r.time for r in simulation.results()] == [first_end(times[w], 2e-4) for w in range(2)]
    assert [r.status.reason for r in simulation.results()] == ["running", "running"]
    simulation.run(until=2e-4)  # they are already there
    simulation.run(until=3e-4, steps=2)
    assert simulation.results()[0].time < 3e-4
    simulation.run(until=5e-4)
    assert [r.time for r in simulation.results()] == [first_end(times[0], 5e-4), FLOWS[1].duration]
    simulation.run()
    same_results(simulation.results(), results)


def test_worlds_wait_for_the_earliest_of_all_observers(simulation, whole):
    results, times = whole
    one, other = Waits([1.1e-4, 3e-4], [2.2e-4]), Waits([2e-4], [])
    simulation.run(until=2.5e-4, observers=[one, other])
    simulation.run(observers=[one, other])
    same_results(simulation.results(), results)
    for observer in (one, other):
        observed_times = np.array(observer.observed)
        for w, pauses in ((0, (0.0, 1.1e-4, 2e-4, 2.5e-4, 3e-4, 1.0)), (1, (0.0, 2.2e-4, 2.5e-4, 1.0))):
            assert {first_end(times[w], t) for t in pauses} <= set(observed_times[:, w])


def test_past_pauses_are_ignored(simulation, whole):
    class Stubborn(Observer):
        observed = 0

        def pause(self, simulation):
            return 1e-4

        def observe(self, simulation):
            self.observed += 1

    stubborn = Stubborn()
    simulation.run(observers=[stubborn])
    same_results(simulation.results(), whole[0])
    assert stubborn.observed >= 3


def test_a_function_is_called_from_the_start_to_the_end(simulation):
    fractions = []
    simulation.run(observers=[lambda simulation_: fractions.append(simulation_.fraction())])
    assert (fractions[0], fractions[-1]) == (0.0, 1.0)
    assert (np.diff(fractions) > 0).all()


def test_an_observer_that_raises_stops_between_two_steps(simulation, whole):
    class Enough(Exception):
        pass

    def stop(sim):
        if sim.fraction() > 0:
            raise Enough

    with pytest.raises(Enough):
        simulation.run(observers=[stop])
    assert simulation.fraction() > 0
    simulation.run()
    same_results(simulation.results(), whole[0])


def test_periodic_checkpoints(simulation, whole, tmp_path):
    path = tmp_path / "c.h5"
    with pytest.raises(InputError, match="seconds between checkpoints must be at least 0; received -1"):
        PeriodicCheckpoint(path, seconds=-1)
    simulation.run(until=1e-4, observers=[PeriodicCheckpoint(path, seconds=3600.0)])
    assert not path.exists()
    simulation.run(until=2e-4, observers=[PeriodicCheckpoint(path, seconds=0.0)])
    simulation.load(FLOWS)
    simulation.restore(path)
    assert [r.time for r in simulation.results()] == [first_end(whole[1][w], 2e-4) for w in range(2)]
    simulation.run()
    same_results(simulation.results(), whole[0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"until": -1.0}, "until must be a number of s of simulated time, at least 0; received -1.0"),
        ({"until": float("nan")}, "until must be a number of s of simulated time, at least 0; received nan"),
        ({"until": "soon"}, "until must be a number of s of simulated time, at least 0; received 'soon'"),
        ({"steps": -1}, "steps must be a whole number, at least 0; received -1"),
        ({"steps": 1.5}, "steps must be a whole number, at least 0; received 1.5"),
        ({"observers": print}, "observers must be a list of them; received <built-in function print>"),
        ({"observers": [3]}, "an observer must be an Observer or a function of the simulation; received 3"),
        ({"observers": [Observer]}, "an observer must be an Observer or a function"),
    ],
)
def test_invalid_arguments_of_run_are_refused(simulation, arguments, message):
    with pytest.raises(InputError, match=message):
        simulation.run(**arguments)
    assert simulation.fraction() == 0


@pytest.mark.parametrize(
    "use",
    [
        lambda sim, path: sim.run(),
        lambda sim, path: sim.results(),
        lambda sim, path: sim.state,
        lambda sim, path: sim.checkpoint(path),
        lambda sim, path: sim.restore(path),
    ],
    ids=["run", "results", "state", "checkpoint", "restore"],
)
def test_an_unloaded_simulation_is_refused(monkeypatch, tmp_path, use):
    sim = compiled(FLOWS[0], 2, CAPACITY)
    monkeypatch.setattr(sim, "scenes", [])
    monkeypatch.delattr(sim, "monitor", raising=False)
    with pytest.raises(InputError, match="simulation must be loaded with a scene before that; received none"):
        use(sim, tmp_path / "checkpoint.h5")
    assert not any(tmp_path.iterdir())
