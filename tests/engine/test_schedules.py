"""A scene gives the same bits on all schedules, on one thread or two, alone or in a batch, and with either
compiler."""

import numpy as np
import pytest

from tests.compare import same_result
from tests.effects.test_contract import kicked
from tests.scenes import GRAIN, compiled, flow, simulate
from tisim import InputError, Simulation
from tisim.engine import compiled_worlds
from tisim.program import team
from tisim.program.team import Teams

WORLDS = [
    flow(seed=1, grains=150),
    flow(seed=2, grains=150, hardness=1e7, sizes=3.0),
    flow(seed=3, grains=60, surface_energy=30.0, grain_mass=GRAIN / 8, sizes=4.0),
    flow(seed=4, grains=20),
]
"""In these worlds most grains merge; few merge; agglomerates break; there are too few grains for lists."""


BATCH = 240


def crowd():
    """The four worlds among others: one is the last of all, the other three are at arbitrary places."""
    scenes = [flow(seed=100 + k, grains=20 + k % 7, hardness=10.0 ** (4 + k % 5)) for k in range(BATCH)]
    for at, scene in zip((BATCH - 1, 0, 97, 120), WORLDS, strict=True):
        scenes[at] = scene
    return scenes


def pick(results):
    """Results of the four worlds."""
    return [results[at] for at in (BATCH - 1, 0, 97, 120)]


@pytest.fixture(scope="module")
def usual():
    """The four worlds among 236 others, one thread for each world."""
    batch = simulate(crowd(), worlds=BATCH, capacity=200, schedule="world")
    results = pick(batch)
    assert all(result.status.ok for result in batch)
    assert len({result.work["steps"] for result in batch}) > 10
    assert sum(result.work["merges"] for result in results) > 50
    assert sum(result.work["fractures"] for result in results) > 10
    assert sum(result.work["impacts"] for result in results) > 200
    return results


def test_a_run_in_portions_is_the_same(usual):
    """Three steps at a time: an interruption of a run does not change it."""
    simulation = compiled(WORLDS[0], BATCH, 200, "world")
    simulation.load(crowd())
    for _ in range(100):
        simulation.run(steps=3)
    simulation.run()
    for a, b in zip(usual, pick(simulation.results()), strict=True):
        same_result(a, b)


@pytest.mark.long
def test_a_launch_for_each_phase(usual):
    """A launch for each phase over all particles, against a thread that runs all phases of a world."""
    launched = simulate(WORLDS, worlds=len(WORLDS), capacity=200, schedule="particle")
    for a, b in zip(usual, launched, strict=True):
        same_result(a, b)


@pytest.mark.slow
@pytest.mark.parametrize(("worlds", "times"), [(4, 8), (4, 0), (1, 8)])
def test_a_team_of_threads(usual, monkeypatch, worlds, times):
    """All threads share a world, here one world after another; in one case they part after each step. Each
    thread must see the work of the others: events of two grains in different shares, lists, failures."""
    monkeypatch.setattr(compiled_worlds, "Teams", lambda *of: Teams(*of[:-1], number=1))
    monkeypatch.setattr(team, "TIMES_LATE", times)
    simulation = Simulation(WORLDS[0], worlds, 200, "team")
    assert simulation.teams.shared == (simulation.runtime.threads > 1)
    simulation.load(WORLDS[:worlds])
    simulation.run(steps=3)
    simulation.run()
    for a, b in zip(usual, simulation.results(), strict=False):
        same_result(a, b)
    simulation.close()


@pytest.mark.slow
def test_alone_and_in_a_batch_of_240(usual):
    """A batch of one, with no more capacity than each world needs."""
    capacity = max(scene.capacity() for scene in WORLDS)
    for a, scene in zip(usual, WORLDS, strict=True):
        (alone,) = simulate([scene], worlds=1, capacity=capacity)
        same_result(a, alone)


@pytest.mark.long
def test_one_thread_and_two_and_both_backends(usual, elsewhere):
    for w, result in enumerate(usual):
        for name, values in result.state.items():
            np.testing.assert_array_equal(values, elsewhere[f"{w}/{name}"], err_msg=f"{w} {name}")
        work = [result.work[key] for key in sorted(result.work)]
        assert elsewhere[f"{w}/work"].tolist() == work


@pytest.mark.long
def test_noise_with_one_thread_and_two_and_both_backends(elsewhere):
    """Counter-based noise does not depend on the thread; here each particle is drawn in a launch of
    its own."""
    (result,) = simulate([kicked()], worlds=1, capacity=32, schedule="particle")
    for name, values in result.state.items():
        np.testing.assert_array_equal(values, elsewhere[f"kicked/{name}"], err_msg=name)


def test_unknown_schedule_is_refused():
    with pytest.raises(InputError, match=r"^schedule must be world, team or particle; received 'galaxy'$"):
        Simulation(WORLDS[3], schedule="galaxy")
