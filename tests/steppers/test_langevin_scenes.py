"""Scenes stepped by Langevin dynamics: the same bits on every schedule, refusals, the step guard, held and
hard particles."""

import numpy as np
import pytest

from tests.compare import same_result
from tests.scenes import compiled, simulate
from tests.steppers.brownian.colloids import Stop
from tests.steppers.langevin_reference import MASS, RADIUS, SPEED, TEMPERATURE, TIME, VISCOSITY, particles
from tests.throwaway import SoftShell
from tisim import Box, InputError, Simulation
from tisim.effects import (
    ChowDrag,
    Contact,
    ContactFriction,
    Impact,
    Lorentz,
    StokesDrag,
)
from tisim.engine.checkpoint import restore, save
from tisim.sources import MagneticField
from tisim.steppers import ApproachTime, Langevin

GAP = 4e-10
"""Distance of the surfaces of neighbours, m; friction stops a particle within 7e-11 m."""
SIDE = 4 * (2 * RADIUS + GAP)
BOX = Box(low=(-SIDE / 2,) * 3, high=(SIDE / 2,) * 3)


def lattice(number):
    """The centres of a number of cells of the box."""
    sites = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), -1).reshape(-1, 3)[:number]
    return SIDE / 4 * (sites - 1.5)


def suspension(seed, number=40, **more):
    """Spheres with soft shells on some cells of a periodic box, in a weak trap and a shear flow."""
    draw = np.random.default_rng(seed)
    place = lattice(number) + draw.uniform(-0.3, 0.3, (number, 3)) * GAP
    shell = SoftShell(stiffness=0.2 * MASS / TIME**2, width=2 * GAP)
    more = {"trap": 1e-3, "shear": 1e-3, "fall": 0.1, **more}
    return particles(0.5, 30, number, place, extra=(shell,), domain=BOX, seed=seed, **more)


@pytest.mark.slow
def test_same_bits_on_both_schedules_alone_in_portions_and_resumed(tmp_path):
    scenes = [suspension(seed) for seed in range(3)]
    usual = simulate(scenes, worlds=3, schedule="particle")
    for result in usual:
        assert result.status.ok, result.status.reason
    same_result(usual[1], simulate(scenes, worlds=3, schedule="world")[1])
    same_result(usual[1], simulate([scenes[1]])[0])
    simulation = compiled(scenes[0], 3, schedule="particle")
    simulation.load(scenes)
    simulation.run(steps=11)
    save(simulation, tmp_path / "c.h5")
    simulation.run(steps=5)
    simulation.load(scenes)
    restore(simulation, tmp_path / "c.h5")
    simulation.run()
    same_result(usual[1], simulation.results()[1])
    places = [result.state["position"] for result in usual]
    assert not np.array_equal(places[0], places[1])
    # Neighbours have pushed each other.
    free = simulate([suspension(0).replace({"effects.soft_shell.stiffness": 1e-30})])
    assert np.abs(free[0].state["position"] - places[0]).max() > 0.1 * GAP


def places():
    """Final positions of enough particles for two threads."""
    scenes = [suspension(seed) for seed in range(30)]
    results = simulate(scenes, worlds=30, capacity=40, schedule="particle")
    return [result.state["position"].tolist() for result in results]


@pytest.mark.slow
def test_same_bits_with_one_thread_and_two(in_one_thread):
    assert in_one_thread("steppers.test_langevin_scenes", "places") == places()


@pytest.mark.parametrize("drag", [StokesDrag(viscosity=1e-3), ChowDrag(density=1.2, viscosity=1.8e-5)])
def test_a_second_drag_is_refused(drag):
    name = drag.kind()
    rule = "left out in a scene stepped by langevin, which has Stokes's drag in itself"
    with pytest.raises(InputError, match=f"effects.{name} must be {rule}; received '{name}'"):
        particles(0.1, 1, extra=(drag,))


def test_torques_and_gyrations_are_refused():
    friction = ContactFriction(stiffness=1e-3, static=0.3, dynamic=0.2)
    with pytest.raises(InputError, match="contact_friction must be without torques in a scene stepped"):
        particles(0.1, 1, extra=(Contact(stiffness=1e-3), friction))
    magnet = (MagneticField(constant=(0.0, 0.0, 1.0)), Lorentz())
    with pytest.raises(InputError, match=r"stepper must be one that turns velocities, .* with effects\.lor"):
        particles(0.1, 1, extra=magnet)


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("temperature", -1.0, "at least 0"),
        ("viscosity", 0.0, "greater than 0"),
        ("viscosity", np.inf, "a finite number"),
    ],
)
def test_bad_numbers_are_refused(name, value, rule):
    with pytest.raises(InputError, match=f"langevin.{name} must be {rule}.*; received"):
        particles(0.1, 1).replace({f"stepper.{name}": value})


def test_a_growing_motion_is_stopped_with_the_critical_step():
    """At 1.2 of the critical step of a spring; friction shortens the scaled step, but not enough."""
    a = 0.5
    b = np.sqrt(np.tanh(a / 2) / (a / 2))
    for omega, fine in ((0.85 / (a * b), True), (2.4 / (a * b), False)):
        start = [0.1 * RADIUS, 0.0, 0.0]
        (result,) = simulate(
            [particles(a, 40, position=start, trap=omega, temperature=0.0)], worlds=6, capacity=20_000
        )
        assert result.status.ok == fine, result.status.reason
    assert "the step is 1.11e-09 s, the critical one at most" in result.status.reason
    assert "by effects.trap, at particle 0" in result.status.reason


def test_fixed_particles_stay():
    """An operator fixes particles that pass a place; neither heat nor flow moves them any more."""
    one = particles(0.5, 40, 50, extra=(Stop(place=2e-10),), wind=0.5, seed=4)
    simulation = compiled(one)
    simulation.load([one])
    simulation.run(steps=20)
    (before,) = simulation.results()
    simulation.run()
    (after,) = simulation.results()
    held = before.state["fixed"] == 1
    assert 5 < held.sum() < 45
    np.testing.assert_array_equal(after.state["position"][held], before.state["position"][held])
    assert np.abs(after.state["velocity"][held]).max() == 0
    assert (after.state["position"][~held] != before.state["position"][~held]).all()
    # The guard does not mistake the force that ends for one that changes with the place.
    strong = particles(0.5, 40, 50, extra=(Stop(place=-1.0),), fall=200.0)
    simulation.load([strong])
    simulation.run()
    assert simulation.results()[0].status.ok, simulation.results()[0].status.reason


@pytest.mark.long
def test_hard_spheres_keep_the_temperature_of_the_fluid():
    """Lossless impacts between steps that end when surfaces meet; velocities stay normal, of variance
    kT/m."""
    control = ApproachTime(shortest=1e-3 * TIME, longest=0.2 * TIME)
    stepper = Langevin(temperature=TEMPERATURE, viscosity=VISCOSITY, control=control)
    hard = (Impact(hardness=1e30),)
    draw = np.random.default_rng(9)
    scenes = []
    for seed in range(4):
        sites, speed = lattice(40), SPEED * draw.normal(size=(40, 3))
        scenes.append(
            particles(1.0, 300, 40, sites, speed, extra=hard, domain=BOX, stepper=stepper, seed=seed)
        )
    simulation = Simulation(scenes[0], len(scenes))
    simulation.load(scenes)
    squares = []
    for time in np.linspace(10, 300, 60):
        simulation.run(until=time * TIME)
        squares += [(result.state["velocity"] ** 2).mean() for result in simulation.results()]
    results = simulation.results()
    simulation.close()
    assert all(result.status.ok for result in results)
    assert min(result.work["impacts"] for result in results) > 20
    # Looks that are 5 m/gamma apart are independent.
    error = np.sqrt(2 / (3 * 40 * len(squares)))
    assert np.mean(squares) / SPEED**2 == pytest.approx(1.0, abs=5 * error)
