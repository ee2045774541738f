"""Gaps of rods and spheres, against coal, against a bounded minimisation, and in degenerate positions."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from tests.shapes.pairs import Contact, rod_contacts, sphere_contacts, unit
from tisim.shapes import SpherocylinderShape


def random_rods(rng, count, aspect=100.0):
    """Orientations and rods of diameter about 1 with aspect ratios up to ``aspect``, and separations at which
    their bounding spheres overlap. A tenth is parallel, a tenth nearly so, and a tenth are spheres."""
    rods = np.stack([aspect ** rng.uniform(0, 1, count) / 2, rng.uniform(0.3, 0.6, count)], axis=1)
    rods[rng.random(count) < 0.1, 0] = 0.0
    turn_i, turn_j = Rotation.random(count, rng=rng), Rotation.random(count, rng=rng)
    kind = rng.random((count, 1))
    small = Rotation.from_rotvec(unit(rng.normal(size=(count, 3))) * 10 ** rng.uniform(-16, -1, (count, 1)))
    near = (turn_i * small).as_quat()
    turn_j = Rotation.from_quat(
        np.where(kind < 0.1, turn_i.as_quat(), np.where(kind < 0.2, near, turn_j.as_quat()))
    )
    other = rods[rng.permutation(count)]
    most = rods.sum(axis=1) + other.sum(axis=1)
    separation = unit(rng.normal(size=(count, 3))) * (most * rng.uniform(0, 1, count) ** 1.5)[:, None]
    # Half of the pairs are close side by side.
    close = rng.random(count) < 0.5
    across = turn_i.apply(
        rng.uniform(-1, 1, (count, 3)) * np.stack([other[:, 1] * 2] * 2 + [rods[:, 0]], axis=1)
    )
    return np.where(close[:, None], across, separation), turn_i, rods, turn_j, other


def check_geometry(contact, separation, turn_i, rod_i, turn_j, rod_j, atol):
    """Assert that normals are of length 1, that points are on both surfaces, and that they are one gap apart
    along the normal: with the normal within the cone of each rod at its point, this defines the contact."""
    np.testing.assert_allclose(np.linalg.norm(contact.normal, axis=1), 1, rtol=1e-12)
    between = separation + contact.point_j - contact.point_i
    np.testing.assert_allclose(between, contact.gap[:, None] * contact.normal, rtol=0, atol=atol)
    for sign, turn, rod, point in ((1, turn_i, rod_i, contact.point_i), (-1, turn_j, rod_j, contact.point_j)):
        on_axis = turn.apply(point - sign * rod[:, 1:] * contact.normal, inverse=True)
        np.testing.assert_allclose(on_axis[:, :2], 0, atol=atol)
        assert (np.abs(on_axis[:, 2]) <= rod[:, 0] + atol).all()


@pytest.mark.parametrize("count", [100_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_rods_touch_at_points_of_both_along_a_common_normal(count, rng):
    separation, *pair = random_rods(rng, count)
    contact = rod_contacts(separation, *pair)
    check_geometry(contact, separation, *pair, atol=1e-12)
    # The normal is across each axis, or at an end of it and outwards.
    for sign, turn, rod, point in ((1, *pair[:2], contact.point_i), (-1, *pair[2:], contact.point_j)):
        along = sign * turn.inv().apply(contact.normal)[:, 2]
        place = turn.inv().apply(point - sign * rod[:, 1:] * contact.normal)[:, 2]
        apart = contact.gap + pair[1][:, 1] + pair[3][:, 1] > 1e-4
        at_end = rod[:, 0] - np.abs(place) <= 1e-12 * rod[:, 0] + 1e-13
        outward = np.where(at_end, np.minimum(np.sign(place) * along, 0) * (rod[:, 0] > 0), along)
        assert np.abs(outward[apart]).max() < 1e-6


def test_the_distance_is_the_least_over_both_segments(rng):
    """Against a bounded linear least-squares solver."""
    separation, turn_i, rod_i, turn_j, rod_j = random_rods(rng, 1_000)
    contact = rod_contacts(separation, turn_i, rod_i, turn_j, rod_j)
    axes_i, axes_j = turn_i.apply([0, 0, 1]), turn_j.apply([0, 0, 1])
    for m in range(len(separation)):
        limits = np.maximum([rod_i[m, 0], rod_j[m, 0]], 1e-300)
        found = lsq_linear(
            np.stack([axes_i[m], -axes_j[m]], axis=1), separation[m], (-limits, limits), tol=1e-14
        )
        least = np.linalg.norm(found.fun)
        assert contact.gap[m] + rod_i[m, 1] + rod_j[m, 1] <= least + 1e-12
        assert contact.gap[m] + rod_i[m, 1] + rod_j[m, 1] == pytest.approx(least, abs=1e-7)


def by_coal(separation, turn_i, rod_i, turn_j, rod_j):
    """Gaps and normals of capsules by coal (J. Pan et al., Flexible Collision Library)."""
    coal = pytest.importorskip("coal")
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    identity, gaps, normals = np.zeros(3), np.zeros(len(separation)), np.zeros((len(separation), 3))
    for m, (matrix_i, matrix_j) in enumerate(zip(turn_i.as_matrix(), turn_j.as_matrix(), strict=True)):
        one, other = (coal.Capsule(rod[1], 2 * rod[0]) for rod in (rod_i[m], rod_j[m]))
        result.clear()
        at_i, at_j = coal.Transform3s(matrix_i, identity), coal.Transform3s(matrix_j, separation[m])
        gaps[m], normals[m] = coal.distance(one, at_i, other, at_j, request, result), result.normal
    return gaps, normals


@pytest.mark.parametrize("count", [2_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_gaps_and_normals_agree_with_coal(count, rng):
    separation, *pair = random_rods(rng, count)
    contact = rod_contacts(separation, *pair)
    gaps, normals = by_coal(separation, *pair)
    np.testing.assert_allclose(contact.gap, gaps, rtol=0, atol=1e-6)
    # Parallel rods have many common normals only if their axes meet.
    distance = contact.gap + pair[1][:, 1] + pair[3][:, 1]
    turned = np.linalg.norm(np.cross(contact.normal, normals), axis=1) * np.minimum(distance, 1)
    assert turned.max() < 1e-6


def test_exchange_and_rotation_change_nothing_but_signs(rng):
    separation, turn_i, rod_i, turn_j, rod_j = random_rods(rng, 20_000)
    contact = rod_contacts(separation, turn_i, rod_i, turn_j, rod_j)
    other = rod_contacts(-separation, turn_j, rod_j, turn_i, rod_i)
    np.testing.assert_allclose(other.gap, contact.gap, rtol=0, atol=1e-12)
    turn = Rotation.from_rotvec([0.3, -2.0, 1.1])
    rotated = rod_contacts(turn.apply(separation), turn * turn_i, rod_i, turn * turn_j, rod_j)
    np.testing.assert_allclose(rotated.gap, contact.gap, rtol=0, atol=1e-12)
    # Points of nearly parallel rods are not determined, and normals of crossing axes up to rounding.
    axis = np.stack([turn_i.apply([0, 0, 1]), turn_j.apply([0, 0, 1])])
    distance = contact.gap + rod_i[:, 1] + rod_j[:, 1]
    clear = (np.linalg.norm(np.cross(*axis), axis=1) > 1e-4) & (distance > 1e-4)
    swapped = Contact(other.gap, -other.normal, other.point_j, other.point_i)
    back = Contact(rotated.gap, *(turn.inv().apply(one) for one in rotated[1:]))
    for moved in (swapped, back):
        np.testing.assert_allclose(moved.normal[clear], contact.normal[clear], atol=1e-9)
        np.testing.assert_allclose(moved.point_i[clear], contact.point_i[clear], atol=1e-6)
        np.testing.assert_allclose(moved.point_j[clear], contact.point_j[clear], atol=1e-6)


def contact_of(separation, direction_i, half_i, direction_j, half_j, radius=0.5):
    """The contact of one pair with axes along directions."""
    turns = [
        Rotation.align_vectors([unit(np.array(d, float))], [[0, 0, 1]])[0] for d in (direction_i, direction_j)
    ]
    pairs = [Rotation.concatenate([turn]) for turn in turns]
    rods = [np.array([[half, radius]]) for half in (half_i, half_j)]
    contact = rod_contacts(np.array([separation], float), pairs[0], rods[0], pairs[1], rods[1])
    return Contact(contact.gap[0], *(one[0] for one in contact[1:]))


def test_parallel_rods_touch_at_the_middle_of_their_common_length():
    # From -2 to 2 and from 1 to 5 along z.
    contact = contact_of([1.5, 0, 3], [0, 0, 1], 2.0, [0, 0, -1], 2.0)
    assert contact.gap == pytest.approx(0.5, abs=1e-14)
    np.testing.assert_allclose(contact.normal, [1, 0, 0], atol=1e-14)
    np.testing.assert_allclose(contact.point_i, [0.5, 0, 1.5], atol=1e-14)
    np.testing.assert_allclose(contact.point_j, [-0.5, 0, -1.5], atol=1e-14)


def test_rods_in_line_touch_at_their_ends():
    contact = contact_of([0, 0, 6], [0, 0, 1], 2.0, [0, 0, 1], 1.0)
    assert contact.gap == pytest.approx(2.0, abs=1e-14)
    np.testing.assert_allclose(contact.normal, [0, 0, 1], atol=1e-14)
    np.testing.assert_allclose(contact.point_i, [0, 0, 2.5], atol=1e-14)


def test_coincident_and_crossing_axes_have_a_defined_normal_across_both():
    for direction_j in ([0, 0, 1], [0, 0, -1], [1, 0, 0], [1, 1, 1], [0, 1e-12, 1]):
        contact = contact_of([0, 0, 0], [0, 0, 1], 2.0, direction_j, 3.0)
        assert contact.gap == pytest.approx(-1.0, abs=1e-12)
        assert np.linalg.norm(contact.normal) == pytest.approx(1.0, rel=1e-12)
        np.testing.assert_allclose(contact.normal @ [0, 0, 1], 0, atol=1e-12)
        np.testing.assert_allclose(contact.normal @ unit(np.array(direction_j, float)), 0, atol=1e-12)
    # Axes that pass each other at a distance of rounding errors: the sign is known, and the direction.
    contact = contact_of([0, -1e-15, 0.3], [0, 0, 1], 2.0, [1, 0, 0], 3.0)
    np.testing.assert_allclose(contact.normal, [0, -1, 0], atol=1e-12)


def test_rods_without_a_segment_are_spheres(rng):
    separation = rng.normal(size=(200, 3))
    separation[0] = 0.0
    radii = rng.uniform(0.1, 1, (200, 2))
    spheres = sphere_contacts(separation, radii[:, 0], radii[:, 1])
    size = np.linalg.norm(separation, axis=1)
    np.testing.assert_allclose(spheres.gap, size - radii.sum(axis=1), atol=1e-14)
    np.testing.assert_allclose(spheres.normal[1:], separation[1:] / size[1:, None], atol=1e-14)
    np.testing.assert_array_equal(spheres.normal[0], [0, 0, 1])
    turns = Rotation.random(200, rng=rng), Rotation.random(200, rng=rng)
    zero = np.zeros(200)
    rods = rod_contacts(
        separation,
        turns[0],
        np.stack([zero, radii[:, 0]], axis=1),
        turns[1],
        np.stack([zero, radii[:, 1]], axis=1),
    )
    for found, expected in zip(rods, spheres, strict=True):
        np.testing.assert_allclose(found[1:], expected[1:], rtol=0, atol=1e-14)


def test_a_needle_against_needles_of_its_kind():
    """Two needles of aspect ratio 100 at a right angle, one across the middle of the other: a closed form."""
    needle = SpherocylinderShape(length=99.0, diameter=1.0)
    half, radius = needle.rod()
    for gap in (-0.3, 0.0, 0.3):
        contact = contact_of([0, 1 + gap, 40.0], [0, 0, 1], half, [1, 0, 0], half, radius)
        assert contact.gap == pytest.approx(gap, abs=1e-13)
        np.testing.assert_allclose(contact.point_i, [0, 0.5, 40.0], atol=1e-12)
