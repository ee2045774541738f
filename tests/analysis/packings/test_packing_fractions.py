"""Packing fractions of lattices, of caps and of bodies of all shapes, and the coverage of their intervals."""

import numpy as np
import pytest

from tests.analysis.packings.lattices import FRACTION, lattice, random_packing
from tisim import InputError
from tisim.analysis import PackedBodies, body_at, fraction_profile, packing_fraction, sampled_fraction
from tisim.geometry import CylindricalSurface, Plane
from tisim.shapes import EllipsoidShape, SphereShape, SpherocylinderShape, SuperquadricShape


@pytest.mark.parametrize("name", list(FRACTION))
def test_lattices(name):
    packing = lattice(name, 2, diameter=3e-3, low=(1.0, 0.0, -1.0))
    assert packing_fraction(packing) == pytest.approx(FRACTION[name], rel=1e-13)
    found = sampled_fraction(packing, points=40_000)
    assert found.value == pytest.approx(FRACTION[name], abs=1.5 * found.half)
    assert found.half == pytest.approx(1.96 * np.sqrt(found.value * (1 - found.value) / 40_000), rel=1e-3)


def test_the_bodies_at_points(rng):
    """Against a test of all bodies and all images, for two shapes and sizes."""
    shapes = (
        SuperquadricShape(semi_axes=(0.2, 0.3, 0.5), exponents=(4.0, 2.0, 8.0)),
        EllipsoidShape(semi_axes=(0.1, 0.2, 0.4)),
    )
    made = random_packing(rng, shapes[0], 12, 1.5, (True, True, False))
    scale = rng.uniform(0.5, 1.0, 12)
    kinds = np.arange(12) % 2
    packing = PackedBodies(
        made.position, made.orientation, kinds, scale, shapes, made.low, made.high, made.periodic
    )
    points = rng.uniform(-2, 3, (4000, 3))
    expected = np.full(len(points), -1)
    for body in range(12):
        for x in range(-4, 5):
            for y in range(-4, 5):
                away = points - packing.position[body] - 1.5 * np.array([x, y, 0])
                local = packing.turns[body].apply(away, inverse=True) / scale[body]
                expected[shapes[kinds[body]].contains(local)] = body
    assert (expected >= 0).sum() > 100
    np.testing.assert_array_equal(body_at(packing, points), expected)


def test_intervals_contain_the_fraction_as_often_as_they_should():
    packing = lattice("bcc", 1)
    found = [sampled_fraction(packing, points=500, seed=seed) for seed in range(400)]
    share = np.mean([abs(one.value - FRACTION["bcc"]) <= one.half for one in found])
    assert share == pytest.approx(0.95, abs=0.04)


def test_a_sphere_at_a_wall():
    """Up to a height h a sphere on a plane has pi h^2 (3 R - h)/3 of its volume."""
    ball = SphereShape(diameter=2.0)
    packing = PackedBodies.of(ball, [[0, 0, 1.0]], (-1, -1, 0), (1, 1, 4), periodic=(True, True, False))
    edges = np.array([-1.0, 0.0, 0.5, 1.0, 2.0, 3.0])
    found = fraction_profile(packing, Plane().distances, edges, points=100_000)
    caps = np.pi * edges[1:5] ** 2 * (3 - edges[1:5]) / 3
    np.testing.assert_allclose(found.fraction[1:4], np.diff(caps) / (4 * np.diff(edges[1:5])), atol=0.01)
    assert np.isnan(found.fraction[0])
    assert found.fraction[4] == 0
    assert 0 < found.half[4] < 1e-3
    assert (
        np.abs(np.diff(caps) / (4 * np.diff(edges[1:5])) - found.fraction[1:4]) < 2 * found.half[1:4]
    ).all()


def test_one_file_of_rods_in_a_cylinder():
    """B16: (4 R/3 + L)/(2 R + L) of the cylinder is filled."""
    rod = SpherocylinderShape(length=2.0, diameter=1.0)
    packing = PackedBodies.of(
        rod, [[0, 0, 1.5]], (-0.5, -0.5, 0), (0.5, 0.5, 3.0), periodic=(False, False, True)
    )
    expected = (4 / 3 * 0.5 + 2) / 3
    assert packing_fraction(packing, np.pi / 4 * 3) == pytest.approx(expected, rel=1e-14)
    found = sampled_fraction(packing, lambda r: np.hypot(r[:, 0], r[:, 1]) < 0.5, points=100_000)
    assert found.value == pytest.approx(expected, abs=1.5 * found.half)
    wall = CylindricalSurface(start=(0, 0, -3), end=(0, 0, 6), radius=0.5)
    core = fraction_profile(packing, wall.distances, np.array([0.3, 0.5]), points=100_000)
    # Within 0.2 of the axis: a cylinder of length L with caps of a sphere of 0.5.
    cap = 2 * np.pi / 3 * (0.5**3 - (0.25 - 0.04) ** 1.5)
    filled = (np.pi * 0.04 * 2 + 2 * cap) / (np.pi * 0.04 * 3)
    assert core.fraction[0] == pytest.approx(filled, abs=1.5 * core.half[0])


def test_wrong_regions_are_refused():
    packing = lattice("sc", 1)
    open_box = PackedBodies.of(
        packing.shapes[0], packing.position, (0, 0, 0), (1, 1, 1), periodic=(True, True, False)
    )
    with pytest.raises(InputError, match="periodic must be true along all axes without a volume"):
        packing_fraction(open_box)
    with pytest.raises(InputError, match="volume must be above 0; received -1"):
        packing_fraction(open_box, -1.0)
    with pytest.raises(InputError, match="points in the region must be at least 100; received 0"):
        sampled_fraction(packing, lambda r: r[:, 0] > 2)
    with pytest.raises(InputError, match="edges must be increasing distances"):
        fraction_profile(packing, Plane().distances, np.array([1.0, 0.0]))
    empty = packing.where(np.zeros(1, bool))
    assert packing_fraction(empty) == 0
    assert (body_at(empty, np.zeros((3, 3))) == -1).all()
