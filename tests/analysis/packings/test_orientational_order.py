"""Nematic and cubatic order: perfect, absent, and at finite numbers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.analysis.packings.lattices import lattice
from tisim import InputError
from tisim.analysis import (
    PackedBodies,
    cubatic_order,
    nematic_order,
    nematic_orders,
    random_nematic_order,
    random_order,
)
from tisim.shapes import SphereShape, SpherocylinderShape


def turned(turns):
    """A packing of bodies with these orientations."""
    number, ball = len(turns), SphereShape(diameter=1.0)
    return PackedBodies.of(
        ball, np.zeros((number, 3)), (0, 0, 0), (1, 1, 1), turns.as_quat(scalar_first=True)
    )


def whole_group():
    """The 24 rotations of a cube."""
    return Rotation.create_group("O")


def test_parallel_axes_are_in_nematic_order(rng):
    e = np.array([0.6, 0.0, -0.8])
    found = nematic_order(np.sign(rng.normal(size=(50, 1))) * e)
    assert found.order == pytest.approx(1, abs=1e-14)
    assert abs(found.director @ e) == pytest.approx(1, abs=1e-14)
    # A cone of half angle a about z: the mean of (3 cos^2 - 1)/2. In a plane the director is within it.
    angle, a = np.arange(7) * 2 * np.pi / 7, 0.3
    cone = np.stack([np.sin(a) * np.cos(angle), np.sin(a) * np.sin(angle), np.full(7, np.cos(a))], axis=1)
    assert nematic_order(cone).order == pytest.approx(1.5 * np.cos(a) ** 2 - 0.5, abs=1e-14)
    cone[:, 2] = 0
    assert nematic_order(cone / np.sin(a)).order == pytest.approx(1 / 4, abs=1e-14)
    assert nematic_order(np.eye(3)).order == pytest.approx(0, abs=1e-14)
    with pytest.raises(InputError, match="axes must be at least one; received 0"):
        nematic_order(np.zeros((0, 3)))


def test_each_axis_of_a_body_has_its_order(rng):
    """Bodies that spin about their x axes alone: S2 is 1 for x, and 1/4 for y and z in all directions."""
    first = Rotation.from_rotvec([0.3, -1.1, 0.4])
    turns = first * Rotation.from_rotvec(np.outer(np.arange(12) * 2 * np.pi / 12, [1, 0, 0]))
    x, y, z = nematic_orders(turned(turns))
    assert (x.order, y.order, z.order) == pytest.approx((1, 0.25, 0.25), abs=1e-13)
    assert abs(x.director @ first.apply([1, 0, 0])) == pytest.approx(1)
    rod = SpherocylinderShape(length=1.0, diameter=1.0)
    packing = lattice("sc", 2, shape=rod)
    assert nematic_order(packing.axes()[:, 2]).order == 1


def test_cubes_in_any_of_their_orientations_are_in_cubatic_order(rng):
    frame = Rotation.random(rng=rng)
    turns = frame * whole_group()
    found = cubatic_order(turned(turns))
    assert found.order == pytest.approx(1, abs=1e-13)
    along = np.abs(frame.apply(found.director, inverse=True))
    assert along.max() == pytest.approx(1, abs=1e-7)
    # Without nematic order of any axis.
    for one in nematic_orders(turned(turns)):
        assert one.order == pytest.approx(0, abs=1e-13)
    # Turned by a about one axis, by both signs: 5/2 A - 3/2 along that axis is still 1, not for others.
    a = 0.4
    pair = Rotation.from_rotvec([[0, 0, a], [0, 0, -a]])
    assert cubatic_order(turned(pair)).order == pytest.approx(1, abs=1e-12)
    assert abs(cubatic_order(turned(pair)).director[2]) == pytest.approx(1, abs=1e-6)


def test_cubatic_order_is_the_largest_value_of_its_definition(rng):
    """(4.17) as printed, on a fine net of directions."""
    packing = turned(Rotation.random(60, rng=rng))
    u = packing.axes().reshape(-1, 3)

    def value(n):
        cosine = n @ u.T
        return (35 * cosine**4 - 30 * cosine**2 + 3).sum(axis=1) / (14 * 60)

    found = cubatic_order(packing)
    assert value(found.director[None])[0] == pytest.approx(found.order, abs=1e-13)
    n = rng.normal(size=(100_000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    most = value(n).max()
    assert most <= found.order + 1e-13
    assert most == pytest.approx(found.order, abs=2e-4)


@pytest.mark.parametrize("number", [60, pytest.param(500, marks=pytest.mark.slow)])
def test_random_orientations_have_the_order_of_their_number(number):
    found = random_order(number, samples=300, seed=2)
    error = found.nematic_deviation / np.sqrt(300)
    # The next order in 1/sqrt(N) is a few percent at 60.
    assert found.nematic == pytest.approx(random_nematic_order(number), abs=3 * error + 0.6 / number)
    assert found.cubatic == pytest.approx(0.97 / np.sqrt(number), rel=0.08)
    # The square of the largest eigenvalue is 0.725/N on average: 5 components of variance 3/(10 N), 2/3 of
    # their sum, and a mean of cos^2 of 0.725 over the angle that tells the eigenvalues apart.
    spread = np.sqrt(0.725 / number - random_nematic_order(number) ** 2)
    assert found.nematic_deviation == pytest.approx(spread, rel=0.15)


def test_order_of_many_random_bodies_is_small(rng):
    packing = turned(Rotation.random(20_000, rng=rng))
    assert nematic_order(packing.axes()[:, 2]).order < 4 * random_nematic_order(20_000)
    assert cubatic_order(packing).order < 0.02
