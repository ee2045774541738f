"""Shapes of particles: volumes and moments of inertia by quadrature, support and extents by brute force."""

import numpy as np
import pytest
from scipy.integrate import tplquad
from scipy.special import gamma

from tests.shapes.pairs import spiral
from tisim import InputError
from tisim.effects import (
    HardMixture,
    HardRods,
    HardSuperquadrics,
    RigidMixture,
    RigidRods,
    RigidSuperquadrics,
)
from tisim.shapes import EllipsoidShape, SphereShape, SpherocylinderShape, SuperquadricShape

SHAPES = (
    SphereShape(diameter=1.4),
    SpherocylinderShape(length=0.0, diameter=1.4),
    SpherocylinderShape(length=3.0, diameter=0.5),
    SpherocylinderShape(length=99.0, diameter=1.0),
    EllipsoidShape(semi_axes=(0.5, 1.0, 2.5)),
    SuperquadricShape(semi_axes=(1.0, 1.0, 1.0), exponents=(4.0, 4.0, 4.0)),
    SuperquadricShape(semi_axes=(0.6, 1.0, 2.0), exponents=(3.5, 3.5, 3.5)),
    SuperquadricShape(semi_axes=(0.6, 1.0, 2.0), exponents=(2.0, 5.0, 20.0)),
    SuperquadricShape(semi_axes=(2.0, 1.0, 0.7), exponents=(2.0, 5.0, 3.0)),
    SuperquadricShape(semi_axes=(1.0, 3.0, 0.5), exponents=(2.0, 2.0, 7.0)),
    SuperquadricShape(semi_axes=(1.0, 1.0, 1.0), exponents=(20.0, 20.0, 20.0)),
)
every_shape = pytest.mark.parametrize("shape", SHAPES, ids=str)


@every_shape
def test_volume_and_moments_agree_with_random_points(shape, rng):
    """400,000 points in the bounding box: one part in some hundred."""
    half = shape.half_extents()
    points = half * rng.uniform(-1, 1, (400_000, 3))
    inside = points[shape.contains(points)]
    share = len(inside) / len(points)
    error = np.sqrt((1 - share) / share / len(points))
    assert shape.volume() == pytest.approx(share * 8 * half.prod(), rel=5 * error)
    square = (inside**2).mean(axis=0)
    deviation = 5 * (inside**2).std(axis=0) / np.sqrt(len(inside))
    np.testing.assert_allclose(shape.moments(), square.sum() - square, atol=deviation.sum(), rtol=0)


def test_volume_and_moments_of_unequal_exponents_agree_with_quadrature():
    """(4.21) and (4.29) to (4.31)."""
    a, g = (0.6, 1.0, 2.0), (2.0, 5.0, 3.0)
    shape = SuperquadricShape(semi_axes=a, exponents=g)

    def integral(weight):
        def top(x):
            return a[1] * (1 - (x / a[0]) ** g[0]) ** (1 / g[1])

        def height(x, y):
            return a[2] * max(1 - (x / a[0]) ** g[0] - (y / a[1]) ** g[1], 0.0) ** (1 / g[2])

        value, _ = tplquad(
            lambda z, y, x: weight(x, y, z), 0, a[0], 0, top, 0, height, epsabs=1e-7, epsrel=1e-7
        )
        return 8 * value

    volume = integral(lambda x, y, z: 1.0)
    assert shape.volume() == pytest.approx(volume, rel=2e-6)
    for axis in range(3):
        moment = integral(lambda *r, k=axis: sum(c * c for c in r) - r[k] ** 2) / volume
        assert shape.moments()[axis] == pytest.approx(moment, rel=2e-6)


def test_limits_are_the_sphere_the_ellipsoid_and_the_box():
    ball = SphereShape(diameter=2.0)
    for one in (
        SpherocylinderShape(length=0.0, diameter=2.0),
        EllipsoidShape(semi_axes=(1.0, 1.0, 1.0)),
        SuperquadricShape(semi_axes=(1.0, 1.0, 1.0), exponents=(2.0, 2.0, 2.0)),
    ):
        assert one.volume() == pytest.approx(4 / 3 * np.pi, rel=1e-14)
        np.testing.assert_allclose(one.moments(), ball.moments(), rtol=1e-14)
        assert one.bounding_radius() == ball.bounding_radius() == 1.0
        assert one.equal_volume_radius() == pytest.approx(1.0, rel=1e-14)
    axes = (0.5, 1.0, 2.5)
    round_one, other = EllipsoidShape(semi_axes=axes), SuperquadricShape(semi_axes=axes, exponents=(2, 2, 2))
    assert other.volume() == pytest.approx(round_one.volume(), rel=1e-14)
    np.testing.assert_allclose(other.moments(), round_one.moments(), rtol=1e-14)
    # The volume of a box, as its exponents grow: V / (8 a_1 a_2 a_3) = G(1 + 1/g)^3 / G(1 + 3/g).
    for g, part in ((10.0, 0.89), (20.0, 0.97)):
        cube = SuperquadricShape(semi_axes=axes, exponents=(g, g, g))
        exact = gamma(1 + 1 / g) ** 3 / gamma(1 + 3 / g)
        assert cube.volume() == pytest.approx(8 * np.prod(axes) * exact, rel=1e-13)
        assert part < exact < 1
    # A long rod is a thin stick: L^2/12 about its middle.
    needle = SpherocylinderShape(length=1.0, diameter=1e-6)
    np.testing.assert_allclose(needle.moments(), [1 / 12, 1 / 12, 1e-12 / 8], rtol=1e-5)


@every_shape
def test_support_points_are_the_farthest_of_the_surface(shape):
    points, directions = shape.surface_points(10_000), spiral(100)
    farthest = shape.support(directions)
    height = (farthest * directions).sum(axis=1)
    brute = (points @ directions.T).max(axis=0)
    assert (height >= brute - 1e-12 * shape.bounding_radius()).all()
    np.testing.assert_allclose(height, brute, rtol=0, atol=5e-3 * shape.bounding_radius())
    assert shape.contains(farthest * (1 - 1e-12)).all()
    np.testing.assert_allclose(shape.support(3 * directions), farthest, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.abs(shape.support(np.eye(3))).max(axis=0), shape.half_extents(), rtol=1e-14)


@every_shape
def test_bounding_sphere_touches_the_farthest_points_of_the_surface(shape):
    away = np.linalg.norm(shape.surface_points(20_000), axis=1).max()
    assert away <= shape.bounding_radius() * (1 + 1e-12)
    assert away == pytest.approx(shape.bounding_radius(), rel=2e-3)


def test_bounding_radii_of_equal_exponents_have_a_closed_form():
    """(4.38) and (4.39), with e = 2/g."""
    a, e = np.array([0.6, 1.0, 2.0]), 2 / 3.5
    shape = SuperquadricShape(semi_axes=tuple(a), exponents=(3.5,) * 3)
    expected = np.sqrt(((a * a) ** (1 / (1 - e))).sum() ** (1 - e))
    assert shape.bounding_radius() == pytest.approx(expected, rel=1e-13)
    ball = SuperquadricShape(semi_axes=(1.5,) * 3, exponents=(5.0,) * 3)
    assert ball.bounding_radius() == pytest.approx(1.5 * 3 ** ((1 - 2 / 5) / 2), rel=1e-13)
    # Exponents that approach 2.
    for excess in (1e-3, 1e-6, 1e-9, 1e-12):
        close = SuperquadricShape(semi_axes=(1.5,) * 3, exponents=(2 + excess,) * 3)
        assert close.bounding_radius() == pytest.approx(1.5 * 3 ** (excess / (2 + excess) / 2), rel=1e-8)


def test_kernels_know_each_shape_as_a_rod_or_a_superquadric():
    assert SphereShape(diameter=2.0).rod() == (0.0, 1.0)
    assert SphereShape(diameter=2.0).superquadric() == ((1.0,) * 3, (2.0,) * 3)
    rod = SpherocylinderShape(length=4.0, diameter=1.0)
    assert rod.rod() == (2.0, 0.5)
    assert rod.superquadric() is None
    assert rod.aspect_ratio == 5.0
    ellipsoid = EllipsoidShape(semi_axes=(1.0, 2.0, 3.0))
    assert ellipsoid.rod() is None
    assert ellipsoid.superquadric() == ((1.0, 2.0, 3.0), (2.0,) * 3)


@pytest.mark.parametrize(
    ("shape", "settings", "message"),
    [
        (SphereShape, {"diameter": 0}, "sphere_shape.diameter must be greater than 0.0; received 0"),
        (
            SpherocylinderShape,
            {"length": -1, "diameter": 1},
            "spherocylinder_shape.length must be at least 0.0; received -1",
        ),
        (
            EllipsoidShape,
            {"semi_axes": (1, 0, 1)},
            r"ellipsoid_shape.semi_axes must be three numbers greater than 0; received \(1.0, 0.0, 1.0\)",
        ),
        (
            SuperquadricShape,
            {"semi_axes": (1, 1, 1), "exponents": (2, 2, 1.9)},
            r"superquadric_shape.exponents must be three numbers from 2 to 20; received \(2.0, 2.0, 1.9\)",
        ),
        (
            SuperquadricShape,
            {"semi_axes": (1, 1, 1), "exponents": (2, 2, 21)},
            r"superquadric_shape.exponents must be three numbers from 2 to 20; received \(2.0, 2.0, 21.0\)",
        ),
        *(
            (
                shape,
                settings,
                f"^the thickness of {shape.kind()} must be at least 1e-07 of the diameter of its",
            )
            for shape, settings in (
                (SpherocylinderShape, {"length": 1e100, "diameter": 1e-3}),
                (EllipsoidShape, {"semi_axes": (1e-3, 1e-3, 2e4)}),
                (SuperquadricShape, {"semi_axes": (1e100, 1e-3, 1e-3), "exponents": (4, 2, 3)}),
            )
        ),
    ],
)
def test_shapes_without_a_strictly_convex_body_are_refused(shape, settings, message):
    with pytest.raises(InputError, match=message):
        shape(**settings)


def test_effects_take_shapes_of_any_class_that_have_their_form():
    """Spheres are rods and superquadrics, and ellipsoids are superquadrics."""
    sphere, ellipsoid = SphereShape(diameter=2.0), EllipsoidShape(semi_axes=(1.0, 2.0, 3.0))
    rod = SpherocylinderShape(length=1.0, diameter=0.5)
    for kind in (HardRods, RigidRods):
        given = [sphere, {"length": 3, "diameter": 1}, rod]
        assert kind(rods=given).rods == (
            SpherocylinderShape(length=0.0, diameter=2.0), SpherocylinderShape(length=3.0, diameter=1.0), rod
        )  # fmt: skip
        rule = "must be a spherocylinder_shape or sphere_shape; received EllipsoidShape"
        with pytest.raises(InputError, match=rf"^{kind.kind()}.rods\[1\] {rule}"):
            kind(rods=(rod, ellipsoid))
    ball, axes = ((1.0,) * 3, (2.0,) * 3), (1.0, 2.0, 3.0)
    known = SuperquadricShape(semi_axes=axes, exponents=(3, 3, 3))
    for kind in (HardSuperquadrics, RigidSuperquadrics):
        made = kind(superquadrics=(sphere, ellipsoid, known)).superquadrics
        assert [one.superquadric() for one in made] == [ball, (axes, (2.0,) * 3), (axes, (3.0,) * 3)]
        rule = "must be a superquadric_shape, ellipsoid_shape or sphere_shape; received Sphero"
        with pytest.raises(InputError, match=rf"^{kind.kind()}.superquadrics\[0\] {rule}"):
            kind(superquadrics=[rod])
    for kind in (HardMixture, RigidMixture):
        mixed = kind(rods=(sphere, rod), superquadrics=(ellipsoid, sphere))
        assert [one.rod() for one in mixed.rods] == [(0.0, 1.0), (0.5, 0.25)]
        assert [one.superquadric() for one in mixed.superquadrics] == [(axes, (2.0,) * 3), ball]
    with pytest.raises(InputError, match=r"^hard_rods.rods.1.length must be given"):
        HardRods(rods=[sphere, {"diameter": 1}])


def test_surface_points_need_a_number():
    with pytest.raises(InputError, match="count must be greater than 0; received 0"):
        SphereShape(diameter=1.0).surface_points(0)
