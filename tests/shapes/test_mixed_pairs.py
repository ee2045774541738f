"""Gaps of a rod and a superquadric, against pairs of known common normal and searches without derivatives."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.shapes.pairs import (
    RodsOfPairs,
    plane_distance,
    random_bodies,
    rod_contacts,
    searched_gap,
    superquadric_contacts,
    touching,
    unit,
)
from tests.shapes.test_superquadric_pairs import check_contact
from tisim.shapes import EllipsoidShape, SphereShape, SpherocylinderShape, SuperquadricShape
from tisim.shapes.gaps import gaps
from tisim.shapes.superquadric_points import WITH_RODS

COUNTS = (
    (10_000, 10.0),
    (10_000, 100.0),
    pytest.param(500_000, 10.0, marks=pytest.mark.slow),
    pytest.param(500_000, 100.0, marks=pytest.mark.slow),
)
"""Numbers of random pairs, and their largest aspect ratios."""


def random_rods(rng, i, aspect=10.0):
    """Rods of radii from 0.2 to 1. A tenth are spheres; a third are parallel to an axis of the body i of
    their pair, to rounding, or nearly so."""
    count = len(i.axes)
    radius = rng.uniform(0.2, 1.0, count)
    half = radius * rng.uniform(0, aspect, count) * (rng.random(count) > 0.1)
    tilt = 10.0 ** rng.uniform(-10, -1, (count, 1)) * (rng.random((count, 1)) < 0.7)
    axis = unit(i.turn.apply(np.eye(3)[rng.integers(0, 3, count)]) + tilt * rng.normal(size=(count, 3)))
    # The half turn about the bisector of z and the axis turns one into the other.
    bisector = unit(axis + np.array([0.0, 0.0, 1.0 + 1e-9]))
    aligned = np.column_stack([np.zeros(count), bisector])
    random = Rotation.random(count, rng=rng).as_quat(scalar_first=True)
    turn = np.where(rng.random((count, 1)) < 1 / 3, aligned, random)
    return RodsOfPairs(Rotation.from_quat(turn, scalar_first=True), half, radius)


def random_pairs(rng, count, low, high, aspect=10.0):
    """Superquadrics and rods, separations, and the normals and gaps with which they were built."""
    i = random_bodies(rng, count, aspect=aspect)
    j = random_rods(rng, i, aspect)
    normal, separation = touching(rng, i, j)
    gap = rng.uniform(low, high, count)
    return i, j, separation + gap[:, None] * normal, normal, gap


def mixed_contacts(separation, i, j, **more):
    return superquadric_contacts(separation, i, j, family=WITH_RODS, **more)


@pytest.mark.parametrize(("count", "aspect"), COUNTS)
def test_no_pair_apart_fails(count, aspect, rng):
    for part in range(0, count, 100_000):
        i, j, separation, normal, gap = random_pairs(rng, min(100_000, count - part), 0.0, 0.3, aspect)
        contact = mixed_contacts(separation, i, j)
        np.testing.assert_allclose(contact.gap, gap, rtol=0, atol=1e-11 * aspect)
        assert np.linalg.norm(np.cross(contact.normal, normal), axis=1).max() < 1e-6
        check_contact(contact, separation, i, j, atol=1e-10 * aspect)


@pytest.mark.parametrize(("count", "aspect"), COUNTS)
def test_no_overlapping_pair_fails(count, aspect, rng):
    """The pairs were built with one common normal; the gap is the one of largest d among all."""
    for part in range(0, count, 100_000):
        # Thinner bodies are overlapped less, as others would leave them on the other side.
        depth = 0.3 if aspect < 100 else 0.02
        i, j, separation, _, gap = random_pairs(rng, min(100_000, count - part), -depth, 0.0, aspect)
        contact = mixed_contacts(separation, i, j)
        assert (contact.gap - gap).min() > -1e-11 * aspect
        check_contact(contact, separation, i, j, atol=1e-10 * aspect)


@pytest.mark.parametrize("count", [75, pytest.param(150, marks=pytest.mark.slow)])
def test_no_search_without_derivatives_finds_a_larger_distance_of_planes(count, rng):
    """The depth of an overlap is the shortest translation that separates: the largest d over all normals."""
    i, j, separation, _, _ = random_pairs(rng, count, -0.5, 0.05)
    contact = mixed_contacts(separation, i, j)
    np.testing.assert_allclose(
        plane_distance(contact.normal, separation, i, j), contact.gap, rtol=0, atol=1e-10
    )
    searched = searched_gap(rng, separation, i, j, 500, 6)
    assert (searched - contact.gap).max() < 1e-9
    # The search itself stalls on some pairs with kinks.
    assert np.quantile(contact.gap - searched, 0.8) < 1e-6


def test_exchange_changes_nothing_but_signs(rng):
    i, j, separation, _, _ = random_pairs(rng, 10_000, -0.02, 0.3)
    contact, swapped = mixed_contacts(separation, i, j), mixed_contacts(-separation, j, i)
    np.testing.assert_allclose(swapped.gap, contact.gap, rtol=0, atol=1e-10)
    np.testing.assert_allclose(-swapped.normal, contact.normal, rtol=0, atol=1e-7)


def test_two_rods_and_two_superquadrics_of_the_family_are_as_in_their_own(rng):
    i, j = random_bodies(rng, 5000), random_bodies(rng, 5000)
    normal, separation = touching(rng, i, j)
    separation += 0.1 * normal
    one, other = superquadric_contacts(separation, i, j), mixed_contacts(separation, i, j)
    np.testing.assert_allclose(other.gap, one.gap, rtol=0, atol=1e-12)
    rods = [RodsOfPairs(Rotation.random(5000, rng=rng), *rng.uniform(0.3, 1, (2, 5000))) for _ in range(2)]
    separation = unit(rng.normal(size=(5000, 3))) * rng.uniform(2.5, 4, (5000, 1))
    sizes = [np.column_stack([rod.half, rod.radius]) for rod in rods]
    closed = rod_contacts(separation, rods[0].turn, sizes[0], rods[1].turn, sizes[1])
    newton = mixed_contacts(separation, *rods)
    apart = closed.gap > 1e-3
    assert apart.sum() > 1000
    np.testing.assert_allclose(newton.gap[apart], closed.gap[apart], rtol=0, atol=1e-9)


@pytest.mark.parametrize("scale", [1e-9, 1e6])
def test_results_scale_with_lengths(scale, rng):
    i, j, separation, _, _ = random_pairs(rng, 3000, -0.1, 0.3)
    contact = mixed_contacts(separation, i, j)
    scaled = mixed_contacts(
        scale * separation,
        i._replace(axes=scale * i.axes),
        j._replace(half=scale * j.half, radius=scale * j.radius),
    )
    np.testing.assert_allclose(scaled.gap / scale, contact.gap, rtol=0, atol=1e-8)
    np.testing.assert_allclose(scaled.normal, contact.normal, rtol=0, atol=1e-7)


def errors_in_this_runtime():
    """Largest errors of gap and normal of pairs of known gap."""
    rng = np.random.default_rng(2)
    i, j, separation, normal, gap = random_pairs(rng, 5000, 0.0, 0.3)
    contact = mixed_contacts(separation, i, j)
    turned = np.linalg.norm(np.cross(contact.normal, normal), axis=1)
    return [float(np.abs(contact.gap - gap).max()), float(turned.max())]


@pytest.mark.slow
def test_errors_in_single_precision_are_those_of_its_input(single):
    gap, turned = single("shapes.test_mixed_pairs", "errors_in_this_runtime")
    assert gap < 1e-5
    assert turned < 2e-3


def test_gaps_of_bodies_of_all_families(rng):
    """Each pair by its own rule: spheres in closed form, the others by the distance of planes."""
    shapes = (
        SpherocylinderShape(length=3.0, diameter=1.0),
        SphereShape(diameter=1.4),
        SuperquadricShape(semi_axes=(0.6, 0.8, 1.2), exponents=(6.0, 5.0, 4.0)),
        EllipsoidShape(semi_axes=(0.6, 0.8, 1.2)),
    )
    count = 400
    kinds, scale = rng.integers(0, 4, count), rng.uniform(0.5, 1.5, count)
    turns = Rotation.random(count, rng=rng)
    pairs = rng.integers(0, count, (2000, 2))
    reach = (scale * np.array([one.bounding_radius() for one in shapes])[kinds])[pairs].sum(axis=1)
    separation = unit(rng.normal(size=(2000, 3))) * (reach * rng.uniform(0.9, 1.1, 2000))[:, None]
    quaternions = turns.as_quat(scalar_first=True)
    gap, normal = gaps(shapes, kinds, scale, quaternions, pairs, separation, np.inf)
    best = np.full(len(pairs), -np.inf)

    def support(bodies, direction):
        inside, reach = turns[bodies].apply(direction, inverse=True), np.zeros(len(bodies))
        for k, shape in enumerate(shapes):
            these = kinds[bodies] == k
            reach[these] = (shape.support(inside[these]) * inside[these]).sum(axis=1)
        return reach * scale[bodies]

    def distance(direction):
        along = (direction * separation).sum(axis=1)
        return along - support(pairs[:, 0], direction) - support(pairs[:, 1], -direction)

    np.testing.assert_allclose(distance(normal), gap, rtol=0, atol=1e-9)
    for cap in (1e-1, 1e-2, 1e-3):
        for _ in range(20):
            best = np.maximum(best, distance(unit(normal + cap * rng.normal(size=normal.shape))))
    assert (best - gap).max() < 1e-9
    spheres = (kinds[pairs] == 1).all(axis=1)
    assert spheres.sum() > 50
    expected = np.linalg.norm(separation, axis=1) - 0.7 * scale[pairs].sum(axis=1)
    np.testing.assert_allclose(gap[spheres], expected[spheres], rtol=0, atol=1e-12)
