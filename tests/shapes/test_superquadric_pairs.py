"""Gaps of superquadrics, against pairs of known common normal, searches without derivatives, and coal."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from tests.shapes.pairs import (
    Bodies,
    Contact,
    beside,
    plane_distance,
    random_bodies,
    rod_contacts,
    searched_gap,
    sphere_contacts,
    superquadric_contacts,
    touching,
    unit,
)
from tisim.shapes import SuperquadricShape
from tisim.shapes.superquadric_points import ELLIPSOIDS, SUPERQUADRICS

FAILED = 1e-6
"""Sine of the angle to the common normal beyond which a pair has failed."""


COUNTS = (
    (10_000, 10.0),
    (10_000, 100.0),
    pytest.param(1_000_000, 10.0, marks=pytest.mark.slow),
    pytest.param(1_000_000, 100.0, marks=pytest.mark.slow),
)
"""Numbers of random pairs, and their largest aspect ratios; bodies of larger ratios are longer."""


def random_pairs(rng, count, low, high, **settings):
    """Two bodies for each pair, separations, and the normals and gaps (between ``low`` and ``high``) with
    which they were built."""
    i, j = random_bodies(rng, count, **settings), random_bodies(rng, count, **settings)
    j = beside(rng, i, j)
    normal, separation = touching(rng, i, j)
    gap = rng.uniform(low, high, count)
    return i, j, separation + gap[:, None] * normal, normal, gap


def check_contact(contact, separation, i, j, atol):
    """Assert that points are on both surfaces with normals along the common normal, one gap apart."""
    np.testing.assert_allclose(np.linalg.norm(contact.normal, axis=1), 1, rtol=1e-12)
    between = separation + contact.point_j - contact.point_i
    np.testing.assert_allclose(between, contact.gap[:, None] * contact.normal, rtol=0, atol=atol)
    for sign, body, point in ((1, i, contact.point_i), (-1, j, contact.point_j)):
        np.testing.assert_allclose(body.level(point), 1, rtol=0, atol=20 * atol / body.axes.min())
        turned = np.linalg.norm(np.cross(sign * contact.normal, body.normal(point)), axis=1)
        assert (turned > FAILED).sum() == 0, turned.max()


@pytest.mark.parametrize(("count", "aspect"), COUNTS)
def test_no_pair_apart_fails(count, aspect, rng):
    """Of convex bodies apart, a common normal between the closest points is the only one: bodies that are
    moved apart along a common normal of touching bodies have a known gap."""
    for part in range(0, count, 100_000):
        size = min(100_000, count - part)
        i, j, separation, normal, gap = random_pairs(rng, size, 0.0, 0.3, aspect=aspect)
        contact = superquadric_contacts(separation, i, j)
        np.testing.assert_allclose(contact.gap, gap, rtol=0, atol=1e-11 * aspect)
        turned = np.linalg.norm(np.cross(contact.normal, normal), axis=1)
        assert (turned > FAILED).sum() == 0, turned.max()
        check_contact(contact, separation, i, j, atol=1e-10 * aspect)


@pytest.mark.parametrize(("count", "aspect"), COUNTS)
def test_no_overlapping_pair_fails(count, aspect, rng):
    """The pairs were built with one common normal; the gap is the one of largest d among all."""
    for part in range(0, count, 100_000):
        size = min(100_000, count - part)
        # Thinner bodies are overlapped less, as others would leave them on the other side.
        depth = 0.3 if aspect < 100 else 0.02
        i, j, separation, _, gap = random_pairs(rng, size, -depth, 0.0, aspect=aspect)
        contact = superquadric_contacts(separation, i, j)
        assert (contact.gap - gap).min() > -1e-11 * aspect
        check_contact(contact, separation, i, j, atol=1e-10 * aspect)


@pytest.mark.parametrize(
    ("count", "directions", "kept"), [(50, 500, 6), pytest.param(1_000, 1000, 8, marks=pytest.mark.slow)]
)
def test_no_search_without_derivatives_finds_a_larger_distance_of_planes(count, directions, kept, rng):
    """The depth of an overlap is the shortest translation that separates: the largest d over all normals."""
    for part in range(0, count, 500):
        i, j, separation, _, _ = random_pairs(rng, min(500, count - part), -0.5, 0.05)
        contact = superquadric_contacts(separation, i, j)
        own = plane_distance(contact.normal, separation, i, j)
        np.testing.assert_allclose(own, contact.gap, rtol=0, atol=1e-10)
        searched = searched_gap(rng, separation, i, j, directions, kept)
        assert (searched - contact.gap).max() < 1e-9
        # The search itself stalls on some pairs with kinks, in which d falls steeply to both sides.
        assert np.quantile(contact.gap - searched, 0.9) < 1e-6


def test_gaps_agree_with_the_distance_of_surface_points_by_slsqp(rng):
    """Six coordinates and two constraints, (4.7) and (4.10), by a general solver."""
    i, j, separation, _, _ = random_pairs(rng, 40, 0.05, 0.5, largest=6.0, aspect=3.0)
    contact = superquadric_contacts(separation, i, j)
    for m in range(len(separation)):
        one, other = i[m : m + 1], j[m : m + 1]
        turn_i, turn_j = one.turn.as_matrix()[0], other.turn.as_matrix()[0]
        surfaces = [
            {
                "type": "eq",
                "fun": lambda x, body=body, k=k: (
                    (np.abs(x[3 * k : 3 * k + 3] / body.axes[0]) ** body.exponents[0]).sum() - 1
                ),
            }
            for k, body in enumerate((one, other))
        ]

        def square(x, m=m, turn_i=turn_i, turn_j=turn_j):
            return ((separation[m] + turn_j @ x[3:] - turn_i @ x[:3]) ** 2).sum()

        towards = [turn.T @ (sign * unit(separation[m])) for sign, turn in ((1, turn_i), (-1, turn_j))]
        start = np.concatenate(
            [0.6 * axes[0] * n for axes, n in zip((one.axes, other.axes), towards, strict=True)]
        )
        found = minimize(
            square, start, constraints=surfaces, method="SLSQP", options={"ftol": 1e-15, "maxiter": 500}
        )
        assert np.sqrt(found.fun) == pytest.approx(contact.gap[m], abs=2e-6)


def test_gaps_agree_with_points_sampled_on_the_surfaces(rng):
    """The distance of samples is larger than the gap, by no more than their spacing."""
    i, j, separation, _, _ = random_pairs(rng, 30, 0.1, 0.5, aspect=2.0)
    contact = superquadric_contacts(separation, i, j)
    for m in range(len(separation)):
        samples = []
        for body in (i, j):
            shape = SuperquadricShape(semi_axes=tuple(body.axes[m]), exponents=tuple(body.exponents[m]))
            samples.append(body.turn[m].apply(shape.surface_points(4000)))
        distance = KDTree(samples[0]).query(separation[m] + samples[1])[0].min()
        assert contact.gap[m] <= distance + 1e-9
        assert distance < contact.gap[m] + 0.1


def by_coal(separation, i, j):
    """Gaps and normals of ellipsoids by coal, by its GJK and EPA algorithms."""
    coal = pytest.importorskip("coal")
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = 1e-8
    request.gjk_max_iterations = request.epa_max_iterations = 2000
    gaps, normals = np.zeros(len(separation)), np.zeros((len(separation), 3))
    for m, (matrix_i, matrix_j) in enumerate(zip(i.turn.as_matrix(), j.turn.as_matrix(), strict=True)):
        one, other = coal.Ellipsoid(*i.axes[m]), coal.Ellipsoid(*j.axes[m])
        result.clear()
        at_i, at_j = coal.Transform3s(matrix_i, np.zeros(3)), coal.Transform3s(matrix_j, separation[m])
        gaps[m], normals[m] = coal.distance(one, at_i, other, at_j, request, result), result.normal
    return gaps, normals


@pytest.mark.parametrize("count", [2_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_gaps_of_ellipsoids_agree_with_coal(count, rng):
    """coal ends its searches at a change of gap or depth of 1e-8, with normals to about the root of that."""
    i, j, separation, _, _ = random_pairs(rng, count, -0.3, 0.3, largest=2.0)
    contact = superquadric_contacts(separation, i, j, family=ELLIPSOIDS)
    gaps, normals = by_coal(separation, i, j)
    # coal gives no answer for one overlapping pair in some hundred, and a larger depth for one in 10,000.
    answered = np.abs(gaps) < 1e300
    assert (contact.gap - gaps)[answered].min() > -2e-7
    same = np.abs(contact.gap - gaps) < 2e-7
    assert (~answered).sum() < 0.01 * count
    assert (answered & ~same).sum() < 1e-3 * count
    turned = np.linalg.norm(np.cross(normals, contact.normal), axis=1)
    assert turned[contact.gap > 0].max() < 5e-3
    # Planes of this normal are the gap apart, for every pair. coal loses the normal of a few pairs that
    # nearly touch, and of deep overlaps with a flat maximum.
    own, theirs = (plane_distance(one, separation, i, j) for one in (contact.normal, normals))
    np.testing.assert_allclose(own, contact.gap, rtol=0, atol=1e-10)
    assert (contact.gap - theirs)[same].min() > -1e-10
    assert ((contact.gap - theirs)[same] > 1e-4).sum() < 1e-3 * count


def test_ellipsoids_have_a_code_path_of_their_own_with_the_same_results(rng):
    i, j, separation, _, _ = random_pairs(rng, 20_000, -0.3, 0.3, largest=2.0)
    general, own = (
        superquadric_contacts(separation, i, j, family=one) for one in (SUPERQUADRICS, ELLIPSOIDS)
    )
    for one, other in zip(own, general, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8)


@pytest.mark.parametrize("scale", [1e-9, 1e6])
def test_results_scale_with_lengths(scale, rng):
    i, j, separation, _, _ = random_pairs(rng, 3000, -0.1, 0.3)
    contact = superquadric_contacts(separation, i, j)
    small = superquadric_contacts(
        scale * separation, *(one._replace(axes=scale * one.axes) for one in (i, j))
    )
    np.testing.assert_allclose(small.normal, contact.normal, rtol=0, atol=1e-8)
    for one, other in zip((small.gap, *small[2:]), (contact.gap, *contact[2:]), strict=True):
        np.testing.assert_allclose(one / scale, other, rtol=0, atol=1e-8)


def errors_in_this_runtime():
    """Largest errors of gap and normal of pairs of known gap, superquadrics and rods."""
    rng = np.random.default_rng(2)
    i, j, separation, normal, gap = random_pairs(rng, 5000, 0.0, 0.3)
    contact = superquadric_contacts(separation, i, j)
    turns = [Rotation.random(5000, rng=rng) for _ in range(2)]
    rods = np.tile([2.0, 0.5], (5000, 1))
    axes = [turn.apply([0, 0, 1]) for turn in turns]
    across = unit(np.cross(*axes))
    along = rng.uniform(-2, 2, (2, 5000, 1))
    place = along[0] * axes[0] - along[1] * axes[1] + (1 + gap[:, None]) * across
    rod = rod_contacts(place, turns[0], rods, turns[1], rods)
    return [
        float(np.abs(contact.gap - gap).max()),
        float(np.linalg.norm(np.cross(contact.normal, normal), axis=1).max()),
        float(np.abs(rod.gap - gap).max()),
        float(np.linalg.norm(np.cross(rod.normal, across), axis=1).max()),
    ]


def test_errors_in_single_precision_are_those_of_its_input(single):
    """Inputs are rounded to f32; the gap follows to a part in 1e6 of the separation, and a normal to the
    rounding divided by the smallest radius of curvature."""
    gap, _, rod, turned = single("shapes.test_superquadric_pairs", "errors_in_this_runtime")
    assert gap < 1e-5
    assert rod < 1e-5
    assert turned < 1e-3


def test_fast_arithmetic_gives_the_same_to_rounding(in_fast_arithmetic):
    errors = in_fast_arithmetic("shapes.test_superquadric_pairs", "errors_in_this_runtime")
    assert max(errors) < 1e-9


def test_spheres_are_superquadrics_of_equal_axes(rng):
    count = 2000
    i, j = random_bodies(rng, count, largest=2.0), random_bodies(rng, count, largest=2.0)
    radii = rng.uniform(0.1, 1, (count, 2))
    i, j = (
        Bodies(body.turn, np.repeat(radius[:, None], 3, 1), body.exponents)
        for body, radius in ((i, radii[:, 0]), (j, radii[:, 1]))
    )
    separation = unit(rng.normal(size=(count, 3))) * rng.uniform(0.1, 3, (count, 1))
    expected = sphere_contacts(separation, radii[:, 0], radii[:, 1])
    for family in (SUPERQUADRICS, ELLIPSOIDS):
        contact = superquadric_contacts(separation, i, j, family=family)
        for one, other in zip(contact, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)


def test_exchange_and_rotation_change_nothing_but_signs(rng):
    i, j, separation, _, _ = random_pairs(rng, 10_000, -0.02, 0.3)
    contact = superquadric_contacts(separation, i, j)
    swapped = superquadric_contacts(-separation, j, i)
    turn = Rotation.from_rotvec([0.3, -2.0, 1.1])
    turned = superquadric_contacts(
        turn.apply(separation), i._replace(turn=turn * i.turn), j._replace(turn=turn * j.turn)
    )
    back = turn.inv()
    for other in (
        Contact(swapped.gap, -swapped.normal, swapped.point_j, swapped.point_i),
        Contact(turned.gap, *(back.apply(one) for one in turned[1:])),
    ):
        np.testing.assert_allclose(other.gap, contact.gap, rtol=0, atol=1e-10)
        np.testing.assert_allclose(other.normal, contact.normal, rtol=0, atol=1e-7)


def boxes(count, exponent, axes=(1.0, 1.0, 1.0)):
    """Aligned bodies of one kind."""
    ones = np.ones((count, 1))
    return Bodies(Rotation.identity(count), ones * axes, ones * np.full(3, exponent))


def test_near_cubes_face_to_face_have_the_normal_of_the_face(rng):
    """Also if one is turned about the normal, or shifted along the face up to its rounded edge."""
    count = 2000
    turn = Rotation.from_rotvec(rng.uniform(0, 2 * np.pi, (count, 1)) * [0, 0, 1.0])
    i, j = boxes(count, 20.0), boxes(count, 20.0)._replace(turn=turn)
    shift = rng.uniform(-0.3, 0.3, (count, 2))
    gap = rng.uniform(-0.1, 0.3, count)
    separation = np.column_stack([shift, 2 + gap])
    contact = superquadric_contacts(separation, i, j)
    np.testing.assert_allclose(contact.gap, gap, rtol=0, atol=1e-9)
    np.testing.assert_allclose(contact.normal, np.broadcast_to([0, 0, 1.0], (count, 3)), atol=1e-7)
    check_contact(contact, separation, i, j, atol=1e-8)


@pytest.mark.parametrize("exponent", [2.0, 3.0, 8.0, 20.0])
def test_concentric_bodies_have_a_defined_depth_and_normal(exponent):
    """The depth of two equal bodies is their least width, along the shortest axis."""
    i = boxes(1, exponent, (1.0, 0.5, 2.0))
    contact = superquadric_contacts(np.zeros((1, 3)), i, i)
    assert contact.gap[0] == pytest.approx(-1.0, abs=1e-9)
    np.testing.assert_allclose(np.abs(contact.normal[0]), [0, 1, 0], atol=1e-6)


def test_pairs_farther_apart_than_the_range_get_a_bound(rng):
    i, j, separation, _, gap = random_pairs(rng, 10_000, 0.0, 0.6)
    contact = superquadric_contacts(separation, i, j, far=0.2)
    near = gap <= 0.2
    np.testing.assert_allclose(contact.gap[near], gap[near], rtol=0, atol=1e-10)
    assert (contact.gap[~near] > 0.2).all()
    assert (contact.gap <= gap + 1e-10).all()
    bound = plane_distance(contact.normal, separation, i, j)
    assert (bound[~near] > 0).all()
