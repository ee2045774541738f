"""Energy, angular momentum and virial ratio against pair-by-pair sums, closed forms and changes of frame."""

import numpy as np
import pytest
from scipy.constants import G

from tisim.analysis import angular_momentum, gravitational_energy, virial_ratio
from tisim.analysis import gravitation as module


@pytest.fixture
def cloud(rng):
    """Position, velocity and mass of some particles."""
    return rng.normal(size=(17, 3)), rng.normal(size=(17, 3)), rng.uniform(1, 2, 17)


@pytest.mark.parametrize("softening", [0.0, 0.7])
@pytest.mark.parametrize("block", [1, 60, 10**6])
def test_energy_is_the_sum_over_pairs_for_any_block_size(cloud, softening, block, monkeypatch):
    position, _, mass = cloud
    monkeypatch.setattr(module, "BLOCK_PAIRS", block)
    expected = sum(
        -G * mass[i] * mass[j] / np.sqrt(((position[i] - position[j]) ** 2).sum() + softening**2)
        for i in range(17)
        for j in range(i)
    )
    assert gravitational_energy(position, mass, softening) == pytest.approx(expected, rel=1e-13)


def test_one_alone_has_no_energy():
    assert gravitational_energy(np.zeros((1, 3)), np.ones(1)) == 0.0


def test_a_circular_pair_obeys_the_virial_theorem():
    """2 K = -U, and L = mu d^2 w."""
    mass, d = np.array([1e9, 3e9]), 2.0
    w = np.sqrt(G * 4e9 / d**3)
    position = np.array([[1.5, 0, 0], [-0.5, 0, 0]]) + np.array([3.0, 4.0, 5.0])
    velocity = np.array([[0, 1.5 * w, 0], [0, -0.5 * w, 0]]) + np.array([7.0, -8.0, 9.0])
    assert virial_ratio(position, velocity, mass) == pytest.approx(1.0, rel=1e-12)
    less = gravitational_energy(position, mass, 0.3) / gravitational_energy(position, mass)
    assert less < 0.99
    assert virial_ratio(position, velocity, mass, 0.3) == pytest.approx(1 / less, rel=1e-12)
    momentum = angular_momentum(position, velocity, mass)
    np.testing.assert_allclose(momentum, [0, 0, 0.75e9 * d**2 * w], rtol=1e-12, atol=1e-3)


def test_angular_momentum_of_a_rigid_body(cloud):
    """L = I w; I includes the moment of inertia of each sphere about its own centre, 2/5 m R^2."""
    position, _, mass = cloud
    radius, w = np.linspace(0.1, 0.5, 17), np.array([0.3, -0.2, 0.5])
    arm = position - mass @ position / mass.sum()
    square = (arm**2).sum(axis=1) + 0.4 * radius**2
    inertia = (mass * square).sum() * np.eye(3) - np.einsum("i,ia,ib->ab", mass, arm, arm)
    spin = np.broadcast_to(w, (17, 3))
    momentum = angular_momentum(position, np.cross(w, position) + 5.0, mass, radius, spin)
    np.testing.assert_allclose(momentum, inertia @ w, rtol=1e-12)
