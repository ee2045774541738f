"""Random starts of packings: uniform over all places inside, and gaps to walls against sampled surfaces."""

import importlib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import ks_2samp

from tests.steppers.packing.test_mechanical_contraction import contact
from tisim import InputError
from tisim.geometry import BoxContainer, CylindricalContainer, SphericalContainer, WedgeContainer
from tisim.packing import random_bodies, wall_gaps
from tisim.shapes import EllipsoidShape, SphereShape, SpherocylinderShape, SuperquadricShape

random_bodies_module = importlib.import_module("tisim.packing.random_bodies")
ROD = SpherocylinderShape(length=2e-3, diameter=1e-3)
SPHERE = SphereShape(diameter=1e-3)
ELLIPSOID = EllipsoidShape(semi_axes=(0.5e-3, 0.8e-3, 1.5e-3))
SUPERQUADRIC = SuperquadricShape(semi_axes=(0.5e-3, 0.8e-3, 1.5e-3), exponents=(2.0, 5.0, 3.0))
CYLINDER, SPHERICAL = CylindricalContainer(diameter=4.0), SphericalContainer()
WEDGE, CUBE = WedgeContainer(length=9.0, angle=0.6), BoxContainer()
SIDE = np.array([8e-3, 8e-3, 8e-3])


@pytest.mark.parametrize(
    ("shape", "container"),
    [(shape, one) for shape in (ROD, SPHERE) for one in (CYLINDER, SPHERICAL, WEDGE, CUBE)]
    + [(shape, one) for shape in (ELLIPSOID, SUPERQUADRIC) for one in (WEDGE, CUBE)],
    ids=lambda one: one.kind(),
)
def test_gaps_equal_the_least_distance_of_sampled_surfaces(shape, container, rng):
    """Samples are inside the surface, and a thousandth of D away from the farthest point at most."""
    count, size = 40_000, 1.3
    positions = container.points(rng.uniform(size=(20, 3)), SIDE, 1.3e-3, 0.0)
    turns = Rotation.random(20, rng=rng)
    found = wall_gaps(shape, positions, turns.as_quat(scalar_first=True), container, SIDE, size)
    surface = size * shape.surface_points(count)
    for k in range(20):
        points = positions[k] + turns[k].apply(surface)
        least = container.distances(points, SIDE, 1.3e-3)[0].min(axis=0)
        assert ((least - found[k] > -1e-15) & (least - found[k] < 2e-6)).all()
    assert found.min() < 0 < found.max()


@pytest.mark.parametrize("shape", [ELLIPSOID, SUPERQUADRIC], ids=lambda one: one.kind())
def test_shapes_without_round_ends_are_refused_in_curved_containers(shape):
    rule = "shape must be a rod or a sphere in a cylindrical_container, which has a curved wall; received"
    with pytest.raises(InputError, match=rule):
        random_bodies(shape, 10, 0.1, CYLINDER)


@pytest.mark.parametrize("container", [CYLINDER, WEDGE, SPHERICAL], ids=lambda one: one.kind())
def test_bodies_are_uniform_over_all_places_at_which_they_cross_no_wall(container, rng):
    """Beside bodies that are drawn in the whole box, of which those inside are kept. At this packing fraction
    few places are taken."""
    start = random_bodies(ROD, 3000, 0.005, container, 7)
    side = np.array(start.box.high)
    volume = container.volume_in(side, ROD.diameter)
    assert 3000 * ROD.volume() / volume == pytest.approx(0.005, rel=1e-12)
    assert start.box.periodic == tuple(not hard for hard in container.walled())
    gaps = wall_gaps(ROD, start.position, start.orientation, container, side)
    assert 0 <= gaps.min() < 1e-5
    places, turns = side * rng.uniform(size=(40_000, 3)), Rotation.random(40_000, rng=rng)
    kept = wall_gaps(ROD, places, turns.as_quat(scalar_first=True), container, side).min(axis=1) >= 0
    assert kept.sum() > 3000
    for here, there in (
        (start.position, places[kept]),
        (Rotation.from_quat(start.orientation, scalar_first=True).as_matrix()[:, :, 2],
         turns[kept].as_matrix()[:, :, 2]),
    ):  # fmt: skip
        for axis in range(3):
            assert ks_2samp(here[:, axis], there[:, axis]).pvalue > 1e-4


def test_a_periodic_start_is_uniform_in_its_cube():
    start = random_bodies(ROD, 2000, 0.05, seed=3)
    assert start.box.periodic == (True, True, True)
    assert 2000 * ROD.volume() / np.prod(start.box.high) == pytest.approx(0.05, rel=1e-12)
    assert ks_2samp(start.position[:, 0] / start.box.high[0], np.linspace(0, 1, 2000)).pvalue > 1e-4
    axes = Rotation.from_quat(start.orientation, scalar_first=True).as_matrix()[:, :, 2]
    assert np.abs((axes**2).mean(axis=0) - 1 / 3).max() < 5 * np.sqrt(4 / 45 / 2000)


@pytest.mark.parametrize("container", [None, CYLINDER], ids=["periodic", "cylinder"])
@pytest.mark.parametrize("shape", [ROD, SPHERE], ids=lambda one: one.kind())
def test_bodies_of_a_start_do_not_overlap(shape, container):
    """Against the least distance of points on both segments, in B16's sense; some are nearly in touch."""
    start, (half, radius) = random_bodies(shape, 200, 0.15, container, 5), shape.rod()
    axes = Rotation.from_quat(start.orientation, scalar_first=True).apply([0.0, 0.0, 1.0])
    ends, side = np.linspace(-half, half, 41), np.array(start.box.high)
    least = []
    for i in range(200):
        apart = start.position[:i] - start.position[i]
        apart -= np.where(start.box.periodic, side * np.round(apart / side), 0)
        for j in np.flatnonzero(np.linalg.norm(apart, axis=1) < 2.6 * (half + radius)):
            a, b = ends[:, None, None] * axes[i], apart[j] + ends[None, :, None] * axes[j]
            least.append(np.linalg.norm(b - a, axis=2).min() - 2 * radius)
    assert -1e-12 < min(least) < 0.3 * radius


@pytest.mark.slow
@pytest.mark.parametrize("shape", [ELLIPSOID, SUPERQUADRIC], ids=lambda one: one.kind())
def test_superquadrics_of_a_start_do_not_overlap(shape):
    """By their kernel. Bounding spheres overlap, so these are not all that keeps bodies apart."""
    start = random_bodies(shape, 100, 0.15)
    turns, side = Rotation.from_quat(start.orientation, scalar_first=True), np.array(start.box.high)
    gaps = []
    for i in range(100):
        apart = start.position[:i] - start.position[i]
        apart -= side * np.round(apart / side)
        near = np.flatnonzero(np.linalg.norm(apart, axis=1) < 2 * shape.bounding_radius())
        gaps += [-contact((shape, shape), apart[j], turns[i], turns[j])[0] for j in near]
    assert len(gaps) > 50
    assert min(gaps) > -1e-12


def test_a_start_depends_on_its_seed_alone():
    one, same, other = (random_bodies(ROD, 50, 0.1, CYLINDER, seed) for seed in (1, 1, 2))
    assert (one.position == same.position).all()
    assert (one.orientation == same.orientation).all()
    assert np.abs(one.position - other.position).max() > 1e-4
    given = one.particles()
    assert given["radius"] == ROD.bounding_radius()
    assert given["mass"] == pytest.approx(ROD.volume())


def test_spheres_fill_a_cylinder_of_their_own_diameter():
    start = random_bodies(SPHERE, 100, 0.3, CylindricalContainer(diameter=1.0))
    np.testing.assert_allclose(start.position[:, :2], 0.5e-3, rtol=0, atol=1e-15)


def test_wrong_starts_are_refused(monkeypatch):
    monkeypatch.setattr(random_bodies_module, "MOST_TRIED", 1_000_000)
    monkeypatch.setattr(random_bodies_module, "MOST_TAKEN", 1000)
    narrow = CylindricalContainer(diameter=1.001)
    for given, message in (
        ((ROD, 50, 0.5), "fraction must be one at which 50 bodies find places at random; received 0.5, with"),
        ((ROD, 0, 0.1), "number must be a whole number, at least 1"),
        ((ROD, 10, 1.0), "fraction must be between 0 and 1"),
        (
            (SpherocylinderShape(length=0.1, diameter=1e-3), 10, 0.1, narrow),
            "fraction must be one at which 10 bodies find places",
        ),
    ):
        with pytest.raises(InputError, match=message):
            random_bodies(*given)
