"""The closed forms of single contacts against each other and against known limits."""

import numpy as np
import pytest

from tisim.cases.common.two_spheres import (
    hertz_force,
)
from tisim.cases.granular_bench.closed_forms import bridge_force, jkr_force, jkr_pull_off, jkr_stretch
from tisim.cases.granular_bench.impacts import ParticleImpact
from tisim.cases.granular_bench.mindlin_impact import oblique_impacts


def test_jkr_pulls_most_at_its_pull_off_and_ends_at_its_stretch():
    energy, radius, modulus = 0.05, 5e-4, 5e6
    end, parts = jkr_stretch(energy, radius, modulus), jkr_pull_off(energy, radius)
    force = [jkr_force(x, energy, radius, modulus) for x in np.linspace(-0.999999 * end, end, 4001)]
    assert min(force) == pytest.approx(-parts, rel=1e-6)
    assert force[0] == pytest.approx(-5 / 9 * parts, rel=2e-3)
    assert jkr_force(0.0, energy, radius, modulus) == pytest.approx(-8 / 9 * parts, rel=1e-12)
    # At large loads it approaches Hertz's law.
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
    """A sliding impact loses mu (1 + e) v, energy never grows, and equal spheres collide as with a plane."""
    slides = ParticleImpact("glass", 0.01, 0.01, friction=0.1, sideways=0.1)
    sticks = ParticleImpact("glass", 0.01, 0.01, friction=5.0, sideways=0.005)
    pairs = ParticleImpact("glass", 0.01, 0.005, friction=5.0, spin=0.5, partner="equal")
    velocity, spin = oblique_impacts([slides, sticks, pairs], 2000)
    assert velocity[0] == pytest.approx(0.1 - 2 * 0.1 * 0.01, rel=1e-6)
    assert spin[0] == pytest.approx(2.5 * 2 * 0.1 * 0.01 / 0.01, rel=1e-3)
    assert abs(velocity[1] - 0.01 * spin[1]) < 0.005
    assert velocity[1] ** 2 + 0.4 * (0.01 * spin[1]) ** 2 < 0.005**2
    alone, turned = oblique_impacts([ParticleImpact("glass", 0.01, 0.005, friction=5.0, spin=0.5)], 2000)
    assert velocity[2] == pytest.approx(alone[0], rel=1e-3)
    assert spin[2] == pytest.approx(turned[0], rel=1e-3)
