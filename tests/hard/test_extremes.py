"""Extreme positions, sizes, speeds and run lengths: the result is right, or a failure names the cause."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.collisions.test_collision_rounds import laws as merging
from tests.collisions.test_collision_rounds import run as run_merging
from tests.effects.test_contract import charges
from tests.effects.test_contract import run as run_charges
from tests.judged import check_message
from tests.scenes import RADIUS, by_id, energy, scene
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
