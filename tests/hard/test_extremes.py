"""Extreme positions, sizes, speeds and run lengths: the result is right, or a failure names the cause."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.collisions.test_collision_rounds import laws as merging
from tests.collisions.test_collision_rounds import run as run_merging
from tests.effects.test_contract import charges
from tests.effects.test_contract import run as run_charges
from tests.judged import check_message
from tests.scenes import DENSITY, RADIUS, by_id, compiled, energy, momentum, scene
from tisim import InputError


def pair(gap, approach, hardness=1e9, radius=RADIUS, **more):
    """Two grains a distance apart along a slanted line of centres, approaching along it."""
    n = np.array([2.0, -3.0, 6.0]) / 7
    return scene(
        [[0, 0, 0], gap * n], [approach * n, 0 * n], merging(hardness), radius=radius, dt=1e-30, **more
    )


def decades(low, high):
    """Numbers at both ends of a range of powers of ten, and between them."""
    return st.floats(low, high).map(lambda power: 10.0**power)


@pytest.mark.long
@settings(max_examples=60, derandomize=True, database=None, deadline=None)
@given(
    masses=st.tuples(decades(-330, 308), decades(-110, 110)),
    radius=decades(-110, 110),
    away=decades(-3, 20),
    approach=decades(-200, 308),
    hardness=decades(-300, 300),
)
def test_any_magnitudes_are_refused_or_give_finite_numbers(masses, radius, away, approach, hardness):
    """Two touching grains of any mass and size, at any distance from the origin, give a message or only
    finite numbers, also in the state of a failed run."""
    try:
        n = np.array([2.0, -3.0, 6.0]) / 7
        place = np.array([radius * away, 0, 0])
        setup = scene(
            [place, place + 2 * radius * (1 - 1e-9) * n],
            [approach * n, 0 * n],
            merging(hardness),
            radius=radius,
            mass=masses,
            dt=1e-30,
        )
        (result,) = run_merging([setup])
    except InputError as fault:
        check_message(str(fault))
        return
    assert result.status.ok or "not finite" in result.status.reason
    assert all(np.isfinite(values).all() for values in result.state.values())


@pytest.mark.long
def test_positions_that_round_together_are_refused():
    """Millimetre grains 1 m apart at 1e17 m round to one point, so their contacts are undefined."""
    place = np.array([1e17, 0, 0])
    setup = scene([place, place + 1e-3], np.zeros((2, 3)), merging(1e9), radius=1e-3, dt=1e-30)
    message = r"particles.position must be so near the origin that f\d\d rounds it by less than a radius"
    with pytest.raises(InputError, match=message):
        run_merging([setup])


@pytest.mark.long
@pytest.mark.parametrize("part", [1e-300, 1e-12, 1e-6])
def test_two_nearly_coincident_grains(part):
    """The line of centres and the impact are defined at any distance whose square is representable."""
    (result,) = run_merging([pair(part * RADIUS, 1.0)])
    assert result.status.ok
    assert all(np.isfinite(values).all() for values in result.state.values())
    np.testing.assert_allclose(momentum(result.state), momentum(result.start), rtol=1e-14)
    before, after = (
        (s["mass"] * (s["velocity"] ** 2).sum(axis=1)).sum() for s in (result.start, result.state)
    )
    assert after <= before * (1 + 1e-14)
    if part >= 1e-12:
        assert result.work["impacts"] == 1


def test_overlap_at_the_start_releases_no_energy():
    """An overlap of 10 %: grains at rest or parting are unchanged; approaching grains collide and lose
    energy."""
    still, parting, closing = run_merging([pair(1.8 * RADIUS, v) for v in (0.0, -1.0, 1.0)])
    for result in (still, parting):
        np.testing.assert_array_equal(result.state["velocity"], result.start["velocity"])
    speed = [(s["velocity"] ** 2).sum() for s in (closing.start, closing.state)]
    assert speed[1] < speed[0]


def test_touching_exactly_at_the_sum_of_radii():
    """Approaching grains whose distance is the sum of radii collide; at the next larger number they do
    not."""
    radius = 0.25
    for gap, impacts in ((0.5, 1), (np.nextafter(0.5, 1), 0)):
        place = [[0, 0, 0], [gap, 0, 0]]
        setup = scene(place, [[1e-3, 0, 0], [1e-3, 0, 0]], merging(1e9), radius=radius, dt=1e-30)
        slow = setup.replace({"particles.velocity": [[1e-3, 0, 0], [0, 0, 0]]})
        together, closing = run_merging([setup, slow])
        assert together.work["impacts"] == 0
        assert closing.work["impacts"] == impacts


@pytest.mark.parametrize("hardness", [1e12, 1e-3], ids=["rebound", "bond"])
def test_mass_and_size_ratios(hardness):
    """Radii 1 : 1000, masses 1 : 1e9 and worse: momentum and energy are right to rounding of the larger."""
    for small, large, density in ((1e-6, 1e-3, DENSITY), (1e-6, 1e-3, [1.0, 1e4]), (1e-9, 1.0, DENSITY)):
        mass = np.asarray(density) * 4 / 3 * np.pi * np.array([small, large]) ** 3
        setup = pair((small + large) * (1 - 1e-12), 10.0, hardness, radius=[small, large], mass=mass)
        (result,) = run_merging([setup])
        assert result.work["impacts"] == 1
        assert result.work["merges"] == (hardness < 1)
        np.testing.assert_allclose(momentum(result.state), momentum(result.start), rtol=1e-14)
        if hardness > 1:
            # The light grain rebounds as from a wall.
            velocity = by_id(result)["velocity"][0]
            np.testing.assert_allclose(velocity, -result.start["velocity"][0], rtol=1e-3)


def test_impact_at_any_speed():
    """Energy is never gained at speeds from 1e-12 m/s to a thousand times the speed of sound in steel."""
    for speed in 10.0 ** np.arange(-12, 7.5, 1.0):
        (result,) = run_merging([pair(2 * RADIUS * (1 - 1e-12), speed, hardness=1e6)])
        before, after = (
            (s["mass"] * (s["velocity"] ** 2).sum(axis=1)).sum() for s in (result.start, result.state)
        )
        assert result.work["impacts"] == 1
        assert 0 < after < before * (1 + 1e-14)
        np.testing.assert_allclose(momentum(result.state), momentum(result.start), rtol=1e-13)


def test_two_coincident_charges_fail_clearly():
    """The force is 1/0: the run fails at once, names force, particle and time, and keeps the start state."""
    bad, good = run_charges(
        [
            charges(
                [[0, 0, 0], [1, 1, 1], [1, 1, 1]], np.zeros((3, 3)), [1e-6] * 3, {"stiffness": 0.0}, dt=1e-3
            ),
            charges(
                [[0, 0, 0], [1, 1, 1], [2, 1, 1]], np.zeros((3, 3)), [1e-6] * 3, {"stiffness": 0.0}, dt=1e-3
            ),
        ]
    )
    assert not bad.status.ok
    for word in ("at t = 0 s", "coulomb", "particle 1", "not finite"):
        assert word in bad.status.reason
    np.testing.assert_array_equal(bad.state["position"], bad.start["position"])
    np.testing.assert_array_equal(bad.state["velocity"], bad.start["velocity"])
    assert good.status.ok


def test_like_charges_from_a_nanometre():
    """Two like charges released at 1e-9 m: with short enough steps the potential energy becomes kinetic."""
    q, gap = 1e-12, 1e-9
    potential_before = 8.9875517873681764e9 * q * q / gap
    tau = np.sqrt(gap**2 / (2 * potential_before))
    setup = charges(
        [[0, 0, 0], [gap, 0, 0]], np.zeros((2, 3)), [q, q], {"stiffness": 0.0}, dt=tau / 200, steps=20_000
    )
    (result,) = run_charges([setup])
    state = result.state
    kinetic = 0.5 * (state["velocity"] ** 2).sum()
    potential = potential_before * gap / np.linalg.norm(state["position"][1] - state["position"][0])
    assert kinetic + potential == pytest.approx(potential_before, rel=1e-4)
    assert kinetic > 0.9 * potential_before
    np.testing.assert_allclose(state["velocity"].sum(axis=0), 0, atol=1e-14 * np.abs(state["velocity"]).max())


def test_reversed_time_returns_to_the_start():
    """Velocity Verlet is symmetric: half an eccentric orbit and back returns to the start, to rounding."""
    q = np.sqrt(4.0 / 8.9875517873681764e9)
    there = charges(
        [[1, 0, 0], [-1, 0, 0]], [[0, 0.7, 0], [0, -0.7, 0]], [q, -q], {"stiffness": 0.0}, dt=0.01, steps=300
    )
    (half,) = run_charges([there])
    state = by_id(half)
    back = charges(state["position"], -state["velocity"], [q, -q], {"stiffness": 0.0}, dt=0.01, steps=300)
    (home,) = run_charges([back])
    np.testing.assert_allclose(by_id(home)["position"], [[1, 0, 0], [-1, 0, 0]], rtol=0, atol=1e-11)


def test_time_does_not_drift_over_a_million_steps():
    """After 1e6 steps of 0.1, which is not a binary fraction, the time is right to its last bit."""
    setup = charges([[0, 0, 0]], [[0, 0, 0]], [0.0], {"stiffness": 0.0}, dt=0.1, duration=1e6)
    simulation = compiled(setup, 40, 32)
    simulation.load([setup])
    simulation.run(steps=10**6)
    (result,) = simulation.results()
    exact = 10**6 * Fraction(0.1)
    assert result.work["steps"] == 10**6
    assert abs(Fraction(result.time) - exact) <= Fraction(np.spacing(result.time))
    naive = np.cumsum(np.full(10**6, 0.1))[-1]
    assert abs(naive - float(exact)) > 1e-7, "plain summation would fail here"


def test_the_energy_helper_counts_every_term():
    """The energy helper used by other tests counts kinetic energy, heat, losses and work with the right
    signs."""
    state = {
        "mass": np.array([2.0]),
        "velocity": np.array([[3.0, 0, 0]]),
        "temperature": np.array([10.0]),
        "cooling_loss": np.array([5.0]),
        "fracture_energy": np.array([7.0]),
        "reaction_heat": np.array([11.0]),
        "deformation_work": np.array([13.0]),
    }
    assert energy(state, heat_capacity=2.0) == 9 + 40 + 5 + 7 - 11 - 13
