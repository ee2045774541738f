"""The size from which self-gravity matters (Z04 4.16), against forces and falls computed independently."""

import numpy as np
import pytest
from scipy.constants import G
from scipy.integrate import quad

from tisim import run
from tisim.cases.agglomeration.problem import GENES
from tisim.cases.agglomeration.self_gravity import (
    DENSITY,
    FALL_DISTANCE,
    HARDNESS,
    bonded,
    bonding_radius,
    falling,
    gravity_radius,
    self_gravity_checks,
)


def mass_of(radius):
    return DENSITY * 4 / 3 * np.pi * radius**3


def test_gravity_of_touching_grains_equals_the_bonding_force():
    b = gravity_radius(HARDNESS, DENSITY)
    attraction = G * mass_of(b) ** 2 / (2 * b) ** 2
    assert attraction == pytest.approx(2 * HARDNESS * np.pi * b**2, rel=1e-12)


def test_the_ranges_of_the_paper_need_kilometres():
    """Z04: "several kilometres in diameter"; its ranges of hardness and density give 9 to 300 km."""
    ranges = {gene.name: (gene.low, gene.high) for gene in GENES}
    least = 2 * gravity_radius(ranges["hardness"][0], ranges["density"][1])
    most = 2 * gravity_radius(ranges["hardness"][1], ranges["density"][0])
    assert least == pytest.approx(9.27e3, rel=1e-3)
    assert most == pytest.approx(293e3, rel=1e-3)


@pytest.mark.parametrize("apart", [3.0, FALL_DISTANCE, 50.0])
def test_grains_that_fall_from_rest_meet_at_the_adhesion_speed(apart):
    """The work of gravity, by quadrature, gives each grain sqrt(3 H/(2 rho)) (Z04 4.15)."""
    b = bonding_radius(HARDNESS, DENSITY, apart)
    work = quad(lambda d: G * mass_of(b) ** 2 / d**2, 2 * b, apart * b)[0]
    assert np.sqrt(work / mass_of(b)) == pytest.approx(np.sqrt(3 * HARDNESS / (2 * DENSITY)), rel=1e-8)


def test_from_far_away_it_is_smaller_by_root_two():
    ratio = gravity_radius(HARDNESS, DENSITY) / bonding_radius(HARDNESS, DENSITY)
    assert ratio == pytest.approx(np.sqrt(2), rel=1e-12)
    scaled = bonding_radius(HARDNESS, DENSITY, area=0.5, length=0.3)
    assert scaled == pytest.approx(np.sqrt(0.15) * bonding_radius(HARDNESS, DENSITY), rel=1e-12)


def test_grains_bond_above_this_radius_only():
    b = bonding_radius(HARDNESS, DENSITY, FALL_DISTANCE)
    np.testing.assert_array_equal(bonded(b * np.array([0.5, 0.99, 1.01, 2.0])), [False, False, True, True])


def test_the_fall_is_the_one_of_newton():
    """The separation halfway in time, by an independent solution of the fall."""
    b = bonding_radius(HARDNESS, DENSITY, FALL_DISTANCE)
    (result,) = run([falling(b, part=0.5)])
    d = np.linalg.norm(np.diff(result.state["position"], axis=0))
    u, start = d / (FALL_DISTANCE * b), FALL_DISTANCE * b
    time = np.sqrt(start**3 / (4 * G * mass_of(b))) * (np.arccos(np.sqrt(u)) + np.sqrt(u * (1 - u)))
    assert time == pytest.approx(result.time, rel=1e-6)


@pytest.mark.slow
def test_checks_hold():
    assert all(check.ok for check in self_gravity_checks())
