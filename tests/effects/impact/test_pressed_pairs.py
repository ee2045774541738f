"""Grains that are pressed together by forces are in contact, not colliding: one impact, for any step."""

import numpy as np
import pytest

from tests.scenes import HEAT_CAPACITY, energy, fixed, momentum, scene, simulate
from tisim import Box
from tisim.analysis import largest_overlap
from tisim.effects import Friction, Heating, Impact, NearField, Reaction
from tisim.steppers import ApproachTime, Collocation, IterationControl, StageControl, Trapezoid, Verlet

RADIUS, MASS, DURATION = 1e-3, 1e-5, 1e-4
ALPHA, FRICTION = 10.0, 0.1
"""m, kg, s; heat of reaction, J/m^2; coefficient of friction."""
ONCE = 2 * ALPHA * np.pi * RADIUS**2
"""Heat of reaction of one bonding impact, J."""


def row(number=2, steps=100, gap=-1e-9, speed=1.0, slip=0.0, pull=1e-6, hardness=1e-3, stepper=None):
    """Grains in a row with gaps of ``gap`` diameters, which attract each other by ``pull`` over distance."""
    x = (np.arange(number) - (number - 1) / 2) * 2 * RADIUS * (1 + gap)
    zero = np.zeros(number)
    return scene(
        np.stack([x, zero, zero], axis=1),
        np.stack([-speed * np.sign(x), slip * np.sign(x), zero], axis=1),
        (
            Impact(hardness=hardness, initial_area=0.3),
            Friction(coefficient=FRICTION),
            Heating(heat_capacity=HEAT_CAPACITY),
            Reaction(energy_density=ALPHA),
            NearField(alpha1=pull),
        ),
        radius=RADIUS,
        mass=MASS,
        duration=DURATION,
        stepper=stepper or fixed(DURATION / steps),
        quantities={"temperature": 300.0},
    )


def run_rows(rows):
    results = simulate(rows, worlds=16, capacity=4)
    for result in results:
        assert result.status.ok, result.status.reason
        assert np.abs(momentum(result.state)).max() <= 1e-14 * MASS
    return results


def heat(result):
    """Heat of reaction, over the heat of one impact."""
    return result.state["reaction_heat"].sum() / ONCE


def total(state, pull=1e-6):
    """Energy of a pair, including the attraction, J."""
    apart = np.linalg.norm(state["position"][1] - state["position"][0])
    return energy(state) + pull * np.log(apart / (2 * RADIUS))


@pytest.mark.long
def test_a_pressed_pair_collides_once_whatever_the_step():
    results = run_rows(
        [row(steps=steps, pull=pull) for steps in (10, 100, 1000) for pull in (1e-9, 1e-6, 1e-4)]
    )
    for result in results:
        assert (result.work["impacts"], result.work["bonds"]) == (1, 1)
        assert result.work["contacts"] >= result.work["steps"] - 2
        assert heat(result) == pytest.approx(1, rel=1e-13)
        assert np.ptp(result.state["velocity"], axis=0).max() <= 1e-15


def test_a_pressed_pair_keeps_the_energy_of_its_impact():
    for result in run_rows([row(steps=steps) for steps in (100, 1000)]):
        kinetic = MASS
        assert total(result.state) == pytest.approx(total(result.start), abs=1e-7 * kinetic)
        warming = HEAT_CAPACITY * MASS * (result.state["temperature"] - 300).sum()
        assert warming == pytest.approx(kinetic + ONCE, rel=1e-3)


def test_a_pair_that_attraction_brings_together_collides_once():
    gaps = (1e-9, 1e-6, 1e-4)
    rows = [row(steps=s, gap=gap, speed=0.0, pull=1e-4, hardness=1e-12) for s in (100, 1000) for gap in gaps]
    for result in run_rows(rows):
        assert (result.work["impacts"], result.work["bonds"]) == (1, 1)
        assert heat(result) == pytest.approx(1, rel=1e-13)


def test_a_pair_that_starts_at_rest_in_contact_never_collides():
    for result in run_rows([row(steps=steps, speed=0.0) for steps in (100, 1000)]):
        assert (result.work["impacts"], heat(result)) == (0, 0)


def test_a_row_comes_to_rest_whatever_the_step():
    few, many = run_rows([row(number=3, steps=steps) for steps in (1000, 10000)])
    assert 2 <= few.work["impacts"] < 30
    assert heat(many) == pytest.approx(heat(few), rel=0.05)


def test_a_pressed_pair_slides_as_friction_lets_it():
    pull, slip = 1e-4, 0.08
    slowing = 2 * FRICTION * pull / (2 * RADIUS) / MASS * DURATION
    assert 0.5 < slowing / (2 * slip) < 0.8
    for result in run_rows([row(steps=s, speed=0.0, slip=slip, pull=pull) for s in (100, 1000)]):
        assert result.work["impacts"] == 0
        slip_left = np.ptp(result.state["velocity"], axis=0)[1]
        assert slip_left == pytest.approx(2 * slip - slowing, rel=0.02)
        assert total(result.state, pull) == pytest.approx(
            total(result.start, pull), abs=1e-3 * MASS * slip**2
        )


STEPPERS = {
    "approach time": lambda dt: Verlet(control=ApproachTime(shortest=dt, longest=dt)),
    "trapezoid": lambda dt: Trapezoid(control=IterationControl(first=dt, longest=dt, shortest=dt / 1e3)),
    "collocation": lambda dt: Collocation(control=StageControl(first=dt, longest=dt, shortest=dt / 1e3)),
}


@pytest.mark.slow
@pytest.mark.parametrize("stepper", STEPPERS)
def test_a_pressed_pair_collides_once_with_other_steppers(stepper):
    for result in run_rows([row(stepper=STEPPERS[stepper](DURATION / steps)) for steps in (100, 1000)]):
        assert (result.work["impacts"], result.work["bonds"]) == (1, 1)
        assert result.work["contacts"] >= 90
        assert heat(result) == pytest.approx(1, rel=1e-13)


def cluster(steps, domain=None, low=-np.inf, side=np.inf):
    """A disturbed cube of 27 hard grains, nearly touching, that attract each other; in a box from ``low`` on
    if it is given."""
    disturbance = np.random.default_rng(0).normal(size=(27, 3))
    sites = np.stack(np.meshgrid(*3 * [np.arange(-1.0, 2.0)]), axis=-1).reshape(-1, 3)
    position = RADIUS * (2.2 * sites + 0.02 * disturbance)
    return scene(
        position if domain is None else low + np.mod(position - low, side),
        np.zeros((27, 3)),
        (Impact(hardness=1e9), Friction(coefficient=FRICTION), NearField(alpha1=1e-2)),
        radius=RADIUS,
        mass=MASS,
        stepper=fixed(2e-3 / steps),
        duration=2e-3,
        **({} if domain is None else {"domain": domain}),
    )


@pytest.mark.long
def test_overlaps_of_a_cluster_shrink_with_the_step():
    deepest = []
    for steps in (500, 2000):
        (result,) = simulate([cluster(steps)], capacity=32)
        assert result.status.ok, result.status.reason
        assert result.work["contacts"] > 5 * steps
        assert np.abs(momentum(result.state)).max() <= 1e-11 * MASS
        moved = result.state["position"].mean(axis=0) - result.start["position"].mean(axis=0)
        assert np.abs(moved).max() < 1e-9 * RADIUS
        deepest.append(largest_overlap(result.state["position"], result.state["radius"]) / RADIUS)
    assert deepest[0] < 0.3
    assert deepest[1] < 0.3 * deepest[0]


@pytest.mark.slow
def test_grains_separated_across_a_face_stay_in_the_box():
    side, low = 16 * RADIUS, np.array([0.0, -8 * RADIUS, -8 * RADIUS])
    box = Box(low=low, high=low + side)
    (result,) = simulate([cluster(500, box, low, side)], capacity=32)
    assert result.status.ok, result.status.reason
    assert result.work["contacts"] > 2500
    assert (result.state["position"] >= low).all()
    assert (result.state["position"] < low + side).all()
    assert largest_overlap(result.state["position"], result.state["radius"], (side,) * 3) < 0.3 * RADIUS
