"""Surfaces of shapes, and gaps of random bodies, of spheres, and of a lattice."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ellipeinc, ellipkinc

from tests.analysis.packings.lattices import lattice, random_packing
from tisim import InputError
from tisim.analysis import (
    PackedBodies,
    curvature_integral,
    radial_distribution,
    surface_area,
    surface_correlation,
)
from tisim.shapes import EllipsoidShape, SphereShape, SpherocylinderShape, SuperquadricShape

ROD = SpherocylinderShape(length=0.3, diameter=0.1)
CUBE = SuperquadricShape(semi_axes=(0.1, 0.1, 0.1), exponents=(8.0, 8.0, 8.0))


@pytest.mark.parametrize("axes", [(1.0, 2.0, 3.0), (10.0, 1.0, 1.1)])
def test_the_area_of_an_ellipsoid_is_legendres(axes):
    a, b, c = sorted(axes, reverse=True)
    phi, m = np.arccos(c / a), a * a * (b * b - c * c) / (b * b * (a * a - c * c))
    elliptic = ellipeinc(phi, m) * np.sin(phi) ** 2 + ellipkinc(phi, m) * np.cos(phi) ** 2
    expected = 2 * np.pi * (c * c + a * b / np.sin(phi) * elliptic)
    assert surface_area(EllipsoidShape(semi_axes=axes)) == pytest.approx(expected, rel=1e-12)


def test_spheres_rods_and_boxes():
    """A superquadric of exponent 20 is between the box of its semi-axes and one of 0.945 of them."""
    ball = SphereShape(diameter=3.0)
    assert surface_area(ball) == pytest.approx(9 * np.pi, rel=1e-14)
    assert curvature_integral(ball) == pytest.approx(6 * np.pi, rel=1e-14)
    superquadric = SuperquadricShape(semi_axes=(1.5,) * 3, exponents=(2.0,) * 3)
    assert surface_area(superquadric) == pytest.approx(9 * np.pi, rel=1e-12)
    assert curvature_integral(superquadric) == pytest.approx(6 * np.pi, rel=1e-12)
    assert surface_area(ROD) == pytest.approx(np.pi * 0.1 * 0.4, rel=1e-14)
    assert curvature_integral(ROD) == pytest.approx(np.pi * (0.3 + 2 * 0.1), rel=1e-14)
    box = SuperquadricShape(semi_axes=(1.0, 2.0, 3.0), exponents=(20.0,) * 3)
    assert 0.9 * 88 < surface_area(box) < 88
    # The mean curvature of a box of sides a, b, c: pi (a + b + c).
    assert 0.93 * 12 * np.pi < curvature_integral(box) < 12 * np.pi


def test_the_area_of_a_superquadric_by_projections(rng):
    """Cauchy: the surface is four times the mean projected area, of polygons of support points."""
    shape = SuperquadricShape(semi_axes=(1.0, 0.6, 0.4), exponents=(3.0, 5.0, 10.0))
    angle, areas = np.arange(720) * 2 * np.pi / 720, []
    for turn in Rotation.random(2000, rng=rng):
        x, y = turn.as_matrix()[:2]
        outline = shape.support(np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y)
        a, b = outline @ x, outline @ y
        areas.append(0.5 * abs(a @ np.roll(b, -1) - b @ np.roll(a, -1)))
    error = 4 * np.std(areas) / np.sqrt(len(areas))
    assert surface_area(shape) == pytest.approx(4 * np.mean(areas), abs=3 * error)
    assert error < 0.005 * surface_area(shape)


@pytest.mark.parametrize("shape", [ROD, CUBE, EllipsoidShape(semi_axes=(0.02, 0.05, 0.1))])
def test_random_bodies_have_no_correlation(rng, shape):
    """At any gap, with two sizes."""
    number = 1500
    packing = random_packing(rng, shape, number, 1.0)
    scale = np.where(rng.random(number) < 0.5, 1.0, 0.5)
    packing = PackedBodies.of(shape, packing.position, packing.low, packing.high, packing.orientation, scale)
    edges = np.linspace(0, 0.1, 6)
    found = surface_correlation(packing, edges)
    # Pairs that are counted in an interval: about 1e4, which scatter by 1 %.
    np.testing.assert_allclose(found, 1, atol=0.05)
    assert abs(found.mean() - 1) < 0.02


def test_spheres_have_the_correlation_of_their_centres(rng):
    packing = random_packing(rng, SphereShape(diameter=0.1), 400, 1.0)
    edges = np.linspace(0, 0.2, 9)
    expected = radial_distribution(packing.position, 0.1 + edges, packing.low, packing.high, packing.sides)
    np.testing.assert_allclose(surface_correlation(packing, edges), expected, rtol=1e-12)


def test_wrong_arguments_are_refused():
    packing = lattice("fcc", 1)
    with pytest.raises(InputError, match="edges must be rising gaps from 0 or above"):
        surface_correlation(packing, np.array([-1.0, 0.0]))
    with pytest.raises(InputError, match="bodies must be at least two; received 1"):
        surface_correlation(lattice("sc", 1), np.array([0.0, 1.0]))
    one = packing
    opened = PackedBodies.of(one.shapes[0], one.position, one.low, one.high, periodic=(True, True, False))
    with pytest.raises(InputError, match="periodic must be true along all axes"):
        surface_correlation(opened, np.array([0.0, 1.0]))
