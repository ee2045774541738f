"""Particles read and written between steps: the run continues as from a start, and other worlds are
unchanged."""

import numpy as np
import pytest

from tests.compare import same_result
from tests.scenes import compiled, fixed, flow
from tisim import Box, InputError, Particles, Scene
from tisim.effects import Mie

pytestmark = pytest.mark.long

FLOWS = [flow(0, grains=60), flow(1, grains=60)]
CAPACITY = max(scene.capacity() for scene in FLOWS)


def crystal(seed=0, lattice=None, speed=None):
    """Particles under a short-ranged pair force, with pair lists and initial forces."""
    draw = np.random.Generator(np.random.Philox(seed))
    axis = np.arange(4) * 1.1 if lattice is None else lattice
    sites = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    velocity = draw.normal(size=sites.shape) if speed is None else speed
    return Scene(
        particles=Particles(position=sites, velocity=velocity, radius=0.5, mass=1.0),
        effects=(Mie(epsilon=1.0, cutoff=2.5),),
        domain=Box(low=(-50.0,) * 3, high=(50.0,) * 3),
        stepper=fixed(1e-3),
        duration=0.2,
    )


@pytest.fixture
def simulation():
    sim = compiled(FLOWS[0], 2, CAPACITY)
    sim.load(FLOWS)
    return sim


def test_the_state_equals_a_result(simulation):
    simulation.run(steps=5)
    for state, result in zip(simulation.states, simulation.results(), strict=True):
        assert (set(state), state.time) == (set(result.state), result.time)
        for name, values in result.state.items():
            np.testing.assert_array_equal(state[name], values)
    with pytest.raises(ValueError, match="read-only"):
        simulation.states[0]["velocity"][0] = 0.0
    with pytest.raises(InputError, match="simulation must be of one world"):
        _ = simulation.state


@pytest.mark.slow
def test_a_written_state_continues_as_a_start():
    """Forces, lists and steps are equal bit for bit, for any new positions; time has advanced."""
    simulation = compiled(crystal(), 2)
    start = crystal(7, lattice=np.arange(4) * 1.3 - 20.0)
    simulation.load([start, crystal(1)])
    simulation.run(until=0.1)
    expected, _ = simulation.results()

    simulation.load([crystal(), crystal(1)])
    simulation.run(steps=30)
    state = simulation.states[0]
    for name in ("position", "velocity"):
        state[name] = start.particles.arrays(start.domain, 0)[name]
    assert state.time == pytest.approx(0.03)
    simulation.run(steps=100)
    result, untouched = simulation.results()
    assert result.time == pytest.approx(0.13)
    for name in ("position", "velocity", "force"):
        np.testing.assert_array_equal(result.state[name], expected.state[name])
    assert result.settings["edited"] == "position at t = 0.03 s; velocity at t = 0.03 s"
    assert "edited" not in untouched.settings
    np.testing.assert_array_equal(result.start["position"], crystal().particles.arrays(None, 0)["position"])
    simulation.load([crystal(1)])
    simulation.run(steps=130)
    same_result(untouched, simulation.results()[0])
    assert "edited" not in simulation.results()[0].settings
    assert simulation.results()[0].start["id"].tolist() == list(range(len(result.start["mass"])))


def test_forces_follow_written_positions():
    simulation = compiled(crystal(), 2)
    simulation.load(crystal())
    force = simulation.state["force"]
    assert np.abs(force).max() > 0.1
    simulation.state["position"] = 1.05 * simulation.state["position"]
    assert np.abs(simulation.state["force"] - force).max() > 0.1


@pytest.mark.slow
def test_short_lists_grow_after_a_write():
    """The next step begins with forces at the written positions, as from a start, not with the previous
    forces."""
    close = crystal(lattice=np.arange(4) * 0.55)
    simulation = compiled(crystal(), 2)
    simulation.load(crystal())
    sizes = simulation.assembly.sizes
    simulation.state["position"] = close.particles.arrays(close.domain, 0)["position"]
    assert simulation.assembly.sizes != sizes
    force = simulation.state["force"]
    simulation.load(close)
    np.testing.assert_array_equal(force, simulation.state["force"])


def test_writing_the_same_values_changes_nothing(simulation):
    """Later events, steps and bits are unchanged too, in both worlds."""
    simulation.run()
    expected = simulation.results()
    simulation.load(FLOWS)
    simulation.run(steps=9)
    for name in ("velocity", "radius", "temperature"):
        simulation.states[1][name] = simulation.states[1][name]
    simulation.run()
    for result, other in zip(simulation.results(), expected, strict=True):
        same_result(result, other)
    assert simulation.results()[1].work["merges"] > 0


def test_a_checkpoint_includes_written_values(simulation, tmp_path):
    simulation.run(steps=5)
    simulation.states[0]["velocity"] = 2.0 * simulation.states[0]["velocity"]
    simulation.checkpoint(tmp_path / "c.h5")
    simulation.run()
    expected = simulation.results()
    simulation.load(FLOWS)
    simulation.restore(tmp_path / "c.h5")
    simulation.run()
    for result, other in zip(simulation.results(), expected, strict=True):
        same_result(result, other)
        assert result.settings == other.settings
    assert "velocity at t = " in simulation.results()[0].settings["edited"]


def test_an_observer_may_write_too(simulation):
    """A thermostat by hand: the run stops at the requested step."""

    def cool(sim):
        if sim.fraction() > 0:
            sim.states[0]["temperature"] = np.full_like(sim.states[0]["temperature"], 300.0)

    simulation.run(steps=4, observers=[cool])
    result, _ = simulation.results()
    assert result.work["steps"] == 4
    assert (result.state["temperature"] == 300.0).all()


N = 60


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("speed", np.zeros(N), "quantity to write must be one of position, velocity, mass, radius.*'speed'"),
        ("id", np.arange(N), "quantity to write must be one of"),
        ("velocity", np.zeros((N, 2)), r"particles.velocity must be of shape \(60, 3\); received \(60, 2\)"),
        ("velocity", 1.0, r"particles.velocity must be of shape \(60, 3\); received \(\)"),
        ("velocity", np.full((N, 3), np.nan), "particles.velocity must be .*; received nan"),
        ("velocity", "fast", "particles.velocity must be numbers; received 'fast'"),
        ("radius", np.full(N, -1.0), "particles.radius must be .*; received -1.0"),
        ("mass", np.zeros(N), "particles.mass must be .*; received 0.0"),
        ("position", np.full((N, 3), 1.0), "particles.position must be inside the domain"),
        ("temperature", np.full(N, -1.0), "particles.temperature must be at least 0 K; received -1.0"),
    ],
)
def test_invalid_writes_are_refused(simulation, name, values, message):
    before = simulation.results()[0]
    with pytest.raises(InputError, match=message):
        simulation.states[0][name] = values
    same_result(simulation.results()[0], before)


def test_a_finished_world_cannot_be_changed(simulation):
    simulation.run()
    velocity = simulation.states[0]["velocity"]
    with pytest.raises(InputError, match="must be one that runs; received 'reached its end'"):
        simulation.states[0]["velocity"] = velocity
    with pytest.raises(InputError, match=r"quantity of particles must be one of position, .* 'speed'"):
        _ = simulation.states[0]["speed"]


@pytest.mark.slow
def test_an_impossible_write_gives_a_clear_failure():
    """Two particles in one place: the force between them is not finite."""
    simulation = compiled(crystal(), 2)
    simulation.load([crystal(), crystal(1)])
    position = simulation.states[0]["position"].copy()
    position[1] = position[0]
    simulation.states[0]["position"] = position
    simulation.run(steps=2)
    bad, good = simulation.results()
    assert not bad.status.ok
    assert "not finite" in bad.status.reason
    assert (good.status.reason, good.work["steps"]) == ("running", 2)


@pytest.mark.slow
def test_forces_are_kept_over_a_run_of_no_steps():
    made = crystal()
    simulation = compiled(made, 1, 64)
    simulation.load([made])
    forces = simulation.s.read("force")
    assert np.abs(forces).max() > 0
    simulation.run(steps=0)
    simulation.begin()
    np.testing.assert_array_equal(simulation.s.read("force"), forces)
