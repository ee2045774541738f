"""Measures of rubble piles, for arrangements with known values."""

import numpy as np
import pytest

from tisim.cases.common.rubble_pile import Asteroid, Conserved, body, clusters_of, inertia


def row(number, apart=1.0, at=(0.0, 0.0, 0.0)):
    place = np.zeros((number, 3))
    place[:, 0] = apart * np.arange(number)
    return place + at


def state_of(position, **more):
    n = len(position)
    state = {
        "position": np.asarray(position, float), "velocity": np.zeros((n, 3)), "spin": np.zeros((n, 3)),
        "radius": np.full(n, 0.5), "mass": np.full(n, 2.0), "moment": np.zeros((n, 3)),
    }  # fmt: skip
    return state | more


def test_grains_within_a_hundredth_of_a_diameter_are_bound():
    assert len(set(clusters_of(state_of(row(3, 1.009))))) == 1
    assert len(set(clusters_of(state_of(row(3, 1.011))))) == 3
    assert body(np.array([0, 1, 1]), np.array([5.0, 1.0, 1.0])).tolist() == [True, False, False]


def block(spin, centre=(30.0, 0.0, 4.0), drift=(1.0, 2.0, 3.0)):
    """Eight grains at the corners of a cube that rotates as a rigid body and drifts; a ninth is far away."""
    corners = np.array(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])).reshape(3, -1).T
    place = np.vstack([corners + centre, [[90.0, 0.0, 0.0]]])
    arm = corners - 0.5
    velocity = np.vstack([np.cross(spin, arm) + drift, [[5.0, 0.0, 0.0]]])
    spins = np.vstack([np.tile(spin, (8, 1)), [[9.0, 9.0, 9.0]]])
    return state_of(place, velocity=velocity, spin=spins)


def test_an_asteroid():
    spin = np.array([0.1, -0.2, 0.3])
    state = block(spin)
    state["moment"] = np.tile([0.0, 0.0, 4.0], (9, 1))
    asteroid = Asteroid.of(state)
    assert asteroid.number == 8
    np.testing.assert_allclose(asteroid.spin, spin)
    assert asteroid.elongation == pytest.approx(1.0, abs=1e-2)
    # A cube with sides that bulge: 1 + 6 slabs of 1/2, 12 quarters of cylinders and 8 eighths of a sphere.
    volume = 1 + 6 * 0.5 + 12 * np.pi / 16 + np.pi / 6
    assert asteroid.density == pytest.approx(16.0 / volume, rel=5e-3)
    assert asteroid.magnetisation == pytest.approx(32.0 / volume, rel=5e-3)
    around = 8 * (2.0 * 0.5 + 0.4 * 2.0 * 0.25)
    np.testing.assert_allclose(inertia(asteroid.grains), around * np.eye(3), atol=1e-12)


def test_conserved_quantities():
    pair = state_of(row(2, 2.0), velocity=np.array([[0, 1.0, 0], [0, -1.0, 0]]))
    pair["spin"] = np.array([[0, 0, 3.0], [0, 0, 0]])
    found = Conserved.of(pair)
    np.testing.assert_allclose(found.momentum, 0.0)
    assert found.momentum_sum == pytest.approx(4.0)
    # L = -2 * 1 * 1 * 2 and 2/5 m R^2 w of the spin.
    np.testing.assert_allclose(found.angular, [0.0, 0.0, -4.0 + 0.4 * 2.0 * 0.25 * 3.0])
    assert found.kinetic == pytest.approx(2.0 + 0.5 * 0.4 * 2.0 * 0.25 * 9.0)
    assert found.gravity == pytest.approx(-6.674e-11 * 4.0 / 2.0, rel=1e-4)


def test_how_flat_an_asteroid_is():
    """A sphere is not flat; the axes of a row across z are the roots of its second moments."""
    assert Asteroid.of(state_of(row(1))).flattening == pytest.approx(1.0)
    # Along x: variance 2/3 of three places at -1, 0, 1, beside R^2/5 of the spheres.
    assert Asteroid.of(state_of(row(3))).flattening == pytest.approx(np.sqrt((2 / 3 + 0.1) / 0.1))
