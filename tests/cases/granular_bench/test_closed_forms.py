"""The closed forms of single contacts against quadrature, bisection and each other."""

import numpy as np
import pytest
from scipy.integrate import quad

from tisim.cases.granular_bench.closed_forms import (
    HERTZ_DURATION,
    HERTZ_MEAN_DEPTH,
    bridge_force,
    hertz_depth,
    hertz_force,
    hertz_overlap,
    jkr_force,
    jkr_pull_off,
    jkr_stretch,
    reduced,
)
from tisim.cases.granular_bench.impacts import ParticleImpact
from tisim.cases.granular_bench.mindlin_impact import oblique_impacts


def test_hertz():
    """Energy in the contact, the time and the mean depth by quadrature, and the overlap of a force."""
    radius, mass, modulus, speed = 2e-3, 3e-4, 5e8, 0.7
    depth = hertz_depth(speed, radius, mass, modulus)
    work = quad(lambda x: hertz_force(x, radius, modulus), 0, depth)[0]
    assert work == pytest.approx(mass * speed**2 / 2, rel=1e-12)
    # In x = 1 - y^2 the root at the turn is no pole.
    slow = [quad(lambda y, k=k: 2 * y * (1 - y**2) ** k / np.sqrt(1 - (1 - y**2) ** 2.5), 0, 1)[0]
            for k in (0, 1.5, 2.5)]  # fmt: skip
    assert pytest.approx(2 * slow[0], rel=1e-9) == HERTZ_DURATION
    assert pytest.approx(slow[2] / slow[1], rel=1e-9) == HERTZ_MEAN_DEPTH
    assert hertz_overlap(hertz_force(1e-5, radius, modulus), radius, modulus) == pytest.approx(1e-5)
    assert hertz_force(-1.0, radius, modulus) == 0
    assert reduced(3.0) == 3.0
    assert reduced(3.0, 6.0) == pytest.approx(2.0)


def test_jkr_pulls_most_at_its_pull_off_and_ends_at_its_stretch():
    energy, radius, modulus = 0.05, 5e-4, 5e6
    end, parts = jkr_stretch(energy, radius, modulus), jkr_pull_off(energy, radius)
    force = [jkr_force(x, energy, radius, modulus) for x in np.linspace(-0.999999 * end, end, 4001)]
    assert min(force) == pytest.approx(-parts, rel=1e-6)
    assert force[0] == pytest.approx(-5 / 9 * parts, rel=2e-3)
    assert jkr_force(0.0, energy, radius, modulus) == pytest.approx(-8 / 9 * parts, rel=1e-12)
    # Pressed hard it is Hertz's.
    deep = 1e4 * end
    assert jkr_force(deep, energy, radius, modulus) == pytest.approx(
        hertz_force(deep, radius, modulus), rel=2e-3
    )


def test_a_bridge_pulls_most_at_contact():
    line = 2 * np.pi * 1e-3 * 0.07 * np.cos(0.4)
    pull = bridge_force(np.array([-1e-5, 0.0, 1e-5]), 1e-3, 0.07, 0.4, 1e-12)
    np.testing.assert_allclose(pull[:2], line, rtol=1e-14)
    assert pull[2] < line


def test_an_impact_in_numpy_slides_or_sticks_as_rigid_spheres_do():
    """Where it slides it loses mu (1 + e) v; energy never grows; twins are as an impact with a plane."""
    slides = ParticleImpact("glass", 0.01, 0.01, friction=0.1, sideways=0.1)
    sticks = ParticleImpact("glass", 0.01, 0.01, friction=5.0, sideways=0.005)
    twins = ParticleImpact("glass", 0.01, 0.005, friction=5.0, spin=0.5, partner="twin")
    velocity, spin = oblique_impacts([slides, sticks, twins], 2000)
    assert velocity[0] == pytest.approx(0.1 - 2 * 0.1 * 0.01, rel=1e-6)
    assert spin[0] == pytest.approx(2.5 * 2 * 0.1 * 0.01 / 0.01, rel=1e-3)
    assert abs(velocity[1] - 0.01 * spin[1]) < 0.005
    assert velocity[1] ** 2 + 0.4 * (0.01 * spin[1]) ** 2 < 0.005**2
    alone, turned = oblique_impacts([ParticleImpact("glass", 0.01, 0.005, friction=5.0, spin=0.5)], 2000)
    assert velocity[2] == pytest.approx(alone[0], rel=1e-3)
    assert spin[2] == pytest.approx(turned[0], rel=1e-3)
