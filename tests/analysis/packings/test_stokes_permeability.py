"""Permeability of packings by the flow through them."""

import numpy as np
import pytest

from tests.sources.pore_flow import lattices
from tisim import InputError
from tisim.analysis import PackedBodies, pore_image, solid_bodies, stokes_permeability
from tisim.shapes import SphereShape, SpherocylinderShape, SuperquadricShape
from tisim.sources import SolidCylinder, SolidSphere

MM = 1e-3


def test_a_lattice_of_spheres_has_the_published_permeability():
    """Spheres at 0.216, in a cell of 2 mm; the sizes of bodies are scales of their shape."""
    low, high = np.array([1.0, 0.0, 0.0]) * MM, np.array([3.0, 2.0, 2.0]) * MM
    radius = 2 * MM * (3 * 0.216 / (4 * np.pi)) ** (1 / 3)
    packing = PackedBodies.of(SphereShape(diameter=MM), [[MM, 0, 0]], low, high, scale=2 * radius / MM)
    drag = lattices.ZICK_HOMSY["simple cubic", 0.216]
    exact = (2 * MM) ** 2 * lattices.sphere_permeability("simple cubic", 0.216, drag)
    found = stokes_permeability(packing, (32, 32, 32))
    np.testing.assert_allclose(found, exact * np.eye(3), rtol=8e-3, atol=1e-6 * exact)


def test_rods_are_cylinders_between_half_spheres():
    turn = np.array([np.cos(np.pi / 6), 0.0, np.sin(np.pi / 6), 0.0])
    rod = SpherocylinderShape(length=3 * MM, diameter=MM)
    packing = PackedBodies.of(rod, [[0, 0, 0], [MM, MM, MM]], [0, 0, 0], [9 * MM] * 3, turn, [1.0, 0.5])
    first, second = solid_bodies(packing)
    axis = (np.sqrt(3) / 2, 0.0, 0.5)
    assert isinstance(first, SolidCylinder)
    assert first.axis == pytest.approx(axis)
    assert (first.radius, first.length, first.round) == pytest.approx((0.5 * MM, 3 * MM, True))
    assert second == SolidCylinder((MM, MM, MM), first.axis, 0.25 * MM, 1.5 * MM, round=True)
    points = np.random.default_rng(0).uniform(-3 * MM, 3 * MM, (500, 3))
    along = np.clip(points @ axis, -1.5 * MM, 1.5 * MM)
    apart = np.linalg.norm(points - along[:, None] * axis, axis=1) - 0.5 * MM
    np.testing.assert_allclose(first.distances(points), apart, atol=1e-12)
    low, high = first.extent()
    surface = (
        points
        - first.distances(points)[:, None]
        * (points - along[:, None] * axis)
        / (first.distances(points) + 0.5 * MM)[:, None]
    )
    assert (surface >= low - 1e-12).all()
    assert (surface <= high + 1e-12).all()
    ball = PackedBodies.of(SphereShape(diameter=MM), [[0, 0, 0]], [0, 0, 0], [9 * MM] * 3)
    assert solid_bodies(ball) == [SolidSphere((0.0, 0.0, 0.0), 0.5 * MM)]


@pytest.mark.slow
def test_random_fibres_lie_between_the_laws():
    """Long straight fibres at 0.05 to 0.15, beside the law of Jackson and James for random fibres, whose data
    scatter by some 30 %: k/a^2 = 3 (-ln phi - 0.931) / (20 phi)."""
    generator = np.random.default_rng(4)
    for number in (10, 20, 30):
        axes = generator.normal(size=(number, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        turns = np.stack([1 + axes[:, 2], -axes[:, 1], axes[:, 0], 0 * axes[:, 0]], axis=1)
        turns /= np.linalg.norm(turns, axis=1)[:, None]
        rod = SpherocylinderShape(length=0.9, diameter=0.08)
        packing = PackedBodies.of(rod, generator.uniform(size=(number, 3)), [0, 0, 0], [1, 1, 1], turns)
        np.testing.assert_allclose(packing.axes()[:, 2], axes, atol=1e-12)
        k = np.trace(stokes_permeability(packing, (48, 48, 48))) / 3 / 0.04**2
        # Fibres overlap.
        phi = 1 - pore_image(packing, 0.01).mean()
        law = 3 * (-np.log(phi) - 0.931) / (20 * phi)
        assert 0.75 < k / law < 1.5, phi


def test_packings_that_the_solver_cannot_take_are_refused():
    ellipsoid = SuperquadricShape(semi_axes=(1.0, 1.0, 2.0), exponents=(2.0, 2.0, 2.0))
    packing = PackedBodies.of(ellipsoid, [[0, 0, 0]], [0, 0, 0], [9, 9, 9])
    with pytest.raises(InputError, match="shapes must be spheres or spherocylinders; received 'superquadric"):
        stokes_permeability(packing, (8, 8, 8))
    box = [0, 0, 0], [9, 9, 9]
    wall = PackedBodies.of(SphereShape(diameter=5.0), [[0, 0, 0]], *box, periodic=(True, True, False))
    with pytest.raises(InputError, match="packing must be periodic along all axes"):
        stokes_permeability(wall, (8, 8, 8))
