"""Unions of spheres, against closed forms for one and two, and under rotation."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.spatial.transform import Rotation as Turn

from tisim.geometry.sphere_union import sphere_union


def between(area, low, high):
    """The integral of a polynomial."""
    whole = area.integ()
    return whole(high) - whole(low)


def two(a, b, d):
    """Volume, centre along the axis, and moments along and across it, for spheres of radii a and b at a
    distance d: slices are discs."""
    x = Polynomial([0, 1])
    plane = (d * d + a * a - b * b) / (2 * d)
    parts = ((a * a - x**2, -a, plane), (b * b - (x - d) ** 2, plane, d + b))
    volume, first, second = (sum(between(np.pi * s * x**k, *ends) for s, *ends in parts) for k in range(3))
    across = sum(between(np.pi / 4 * s**2, *ends) for s, *ends in parts)
    centre = first / volume
    return volume, centre, 2 * across, across + second - volume * centre**2


def test_spheres_apart_are_summed_exactly():
    centre, radius = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 8.0]]), np.array([2.0, 1.0])
    one = sphere_union(centre[:1], radius[:1])
    assert one.volume == pytest.approx(4 / 3 * np.pi * 8, rel=1e-15)
    np.testing.assert_allclose(one.centre, centre[0], rtol=1e-15)
    np.testing.assert_allclose(one.inertia, 0.4 * 4 * one.volume * np.eye(3), rtol=1e-14, atol=1e-14)
    both = sphere_union(centre, radius)
    mass = 4 / 3 * np.pi * radius**3
    assert both.volume == pytest.approx(mass.sum(), rel=1e-15)
    assert both.centre[2] == pytest.approx((mass @ centre[:, 2]) / mass.sum(), rel=1e-15)
    along, across = 0.4 * mass @ radius**2, 0.4 * mass @ radius**2 + 25 * mass.prod() / mass.sum()
    np.testing.assert_allclose(both.inertia, np.diag([across, across, along]), rtol=1e-14, atol=1e-12)


@pytest.mark.parametrize("d", [0.45, 0.7, 1.2, 1.55])
def test_two_overlapping_spheres_are_two_caps(d, rng):
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    place = rng.normal(size=3)
    solid = sphere_union(place + np.outer([0, d], axis), np.array([1.0, 0.6]))
    volume, centre, along, across = two(1.0, 0.6, d)
    assert solid.volume == pytest.approx(volume, rel=2e-8)
    np.testing.assert_allclose(solid.centre, place + centre * axis, rtol=0, atol=2e-8)
    expected = across * np.eye(3) + (along - across) * np.outer(axis, axis)
    np.testing.assert_allclose(solid.inertia, expected, rtol=0, atol=2e-8 * across)


def test_many_spheres_under_rotation_and_by_random_points(rng):
    """The quadrature uses an axis: after a rotation it is a different one."""
    centre, radius = 0.6 * rng.normal(size=(8, 3)), rng.uniform(0.5, 1.0, 8)
    solid = sphere_union(centre, radius)
    turn = Turn.from_rotvec([0.3, -1.0, 0.5]).as_matrix()
    turned = sphere_union(centre @ turn.T, radius)
    assert turned.volume == pytest.approx(solid.volume, rel=1e-8)
    np.testing.assert_allclose(turned.centre, turn @ solid.centre, rtol=0, atol=1e-8)
    size = np.abs(solid.inertia).max()
    np.testing.assert_allclose(turned.inertia, turn @ solid.inertia @ turn.T, rtol=0, atol=1e-8 * size)
    low, high = (centre - radius[:, None]).min(axis=0), (centre + radius[:, None]).max(axis=0)
    points = rng.uniform(low, high, (200_000, 3))
    within = (((points[:, None] - centre) ** 2).sum(axis=2) < radius**2).any(axis=1)
    assert within.mean() * np.prod(high - low) == pytest.approx(solid.volume, rel=0.01)
    np.testing.assert_allclose(points[within].mean(axis=0), solid.centre, rtol=0, atol=0.01)


def test_duplicate_spheres_count_once(rng):
    centre, radius = 0.6 * rng.normal(size=(4, 3)), rng.uniform(0.5, 1.0, 4)
    once = sphere_union(centre, radius)
    twice = sphere_union(np.vstack([centre, centre[[2, 0, 2]]]), np.append(radius, radius[[2, 0, 2]]))
    for one, other in zip(once, twice, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-12, atol=1e-12)
