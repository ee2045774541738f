"""At rest without gravity: grains that attract each other come to rest, measured by a given acceleration."""

import numpy as np
import pytest

from tests.scenes import fixed
from tisim import Particles, Scene, Simulation
from tisim.effects import Contact, ContactDissipation, NearField
from tisim.operators import AtRest

DT, MASS, RADIUS, ACCELERATION = 1e-3, 2.0, 0.05, 3.0
BOUNDS = {"energy": 1e-6, "unbalanced": 1e-4}
TIME = 0.1


def cluster(acceleration: float, damping: float = 1e4) -> Scene:
    """Four grains at the corners of a tetrahedron, which fall onto each other."""
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * 0.04
    return Scene(
        name="cluster",
        particles=Particles(position=corners, velocity=np.zeros((4, 3)), radius=RADIUS, mass=MASS),
        effects=(
            NearField(alpha1=0.5, beta1=1, strength="mass"),
            Contact(stiffness=1e6),
            ContactDissipation(damping=damping),
            AtRest(time=TIME, reference_acceleration=acceleration, **BOUNDS),
        ),
        stepper=fixed(DT),
        duration=20.0,
    )


SCENES = [cluster(ACCELERATION), cluster(2 * ACCELERATION), cluster(ACCELERATION, damping=0.0)]


@pytest.fixture(scope="module")
def simulation():
    compiled = Simulation(SCENES[0], len(SCENES))
    yield compiled
    compiled.close()


@pytest.fixture(scope="module")
def results(simulation):
    simulation.load(SCENES)
    simulation.run()
    return simulation.results()


def test_a_world_that_has_ended_is_restored_with_the_others(simulation, results, tmp_path):
    """The last world runs on; the others end before their duration."""
    simulation.load(SCENES)
    simulation.run(until=1.5 * results[0].time)
    simulation.checkpoint(tmp_path / "c.h5")
    simulation.load(SCENES)
    simulation.restore(tmp_path / "c.h5")
    assert [one.time < 20 for one in simulation.results()] == [True] * 3
    simulation.run()
    for one, whole in zip(simulation.results(), results, strict=True):
        assert (one.status, one.time, one.work) == (whole.status, whole.time, whole.work)
        for name, values in whole.state.items():
            np.testing.assert_array_equal(one.state[name], values, err_msg=name)


def test_ratios_are_over_the_given_acceleration(results):
    for result, g in zip(results, (ACCELERATION, 2 * ACCELERATION, ACCELERATION), strict=True):
        velocity, force = result.state["velocity"], result.state["force"]
        kinetic = 0.5 * MASS * (velocity**2).sum() / (4 * MASS * g * RADIUS)
        unbalanced = np.linalg.norm(force, axis=1).sum() / (4 * MASS * g)
        assert result.measures["kinetic_ratio"] == pytest.approx(kinetic, rel=1e-9)
        assert result.measures["unbalanced_ratio"] == pytest.approx(unbalanced, rel=1e-9)


def test_the_run_ends_when_attraction_and_contact_balance(results):
    """At the end the near field of each grain equals the contact forces on it; nothing moves."""
    result = results[0]
    assert result.status.reason == "grains are at rest, by effects.at_rest"
    assert TIME < result.time < 20.0
    position = result.state["position"]
    distance = np.linalg.norm(position[0] - position[1])
    attraction = 0.5 * MASS**2 / distance
    strain, area = 1 - distance / (2 * RADIUS), np.pi * (RADIUS**2 - distance**2 / 4)
    assert 1e6 * strain**2 * area == pytest.approx(attraction, rel=1e-3)
    assert result.measures["kinetic_ratio"] <= BOUNDS["energy"]
    assert result.measures["unbalanced_ratio"] <= BOUNDS["unbalanced"]


def test_grains_that_never_stop_reach_the_end(results):
    assert results[2].status.reason == "reached its end"
    assert results[2].measures["kinetic_ratio"] > BOUNDS["energy"]
