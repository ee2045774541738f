"""Ellipsoids, hulls and Voronoi cells of known shape."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Voronoi
from scipy.spatial.transform import Rotation
from scipy.stats import special_ortho_group

from tisim import InputError, ShearedBox
from tisim.analysis import (
    Ellipsoid,
    bounding_ellipsoid,
    hull_density,
    hull_volume,
    periodic_sides,
    voronoi_by_shell,
    voronoi_volumes,
)

CORNERS = np.stack(np.meshgrid(*3 * [[-1.0, 1.0]], indexing="ij"), -1).reshape(-1, 3)


def ball(rng, n):
    """Random points in the unit sphere."""
    r = rng.normal(size=(n, 3))
    return r / np.linalg.norm(r, axis=1)[:, None] * rng.uniform(size=(n, 1)) ** (1 / 3)


def test_the_ellipsoid_of_a_box_goes_through_its_corners():
    """A box with half sides a, b, c has semi-axes sqrt(3) a, ..., rotated with the box; in m or km."""
    turn = Rotation.from_euler("xyz", (0.3, -1.0, 2.0)).as_matrix()
    for scale in (1e-6, 1e5):
        corners = scale * (CORNERS * (1.0, 3.0, 2.0) @ turn.T + (5.0, 0.0, -3.0))
        found = bounding_ellipsoid(corners, tolerance=1e-7)
        assert found.semi_axes / scale == pytest.approx(np.sqrt(3) * np.array([3.0, 2.0, 1.0]), rel=1e-6)
        assert found.centre / scale == pytest.approx([5.0, 0.0, -3.0], abs=1e-5)
        np.testing.assert_allclose(np.abs(found.axes @ turn)[:, [1, 2, 0]], np.eye(3), atol=1e-4)
        assert found.level(corners).max() <= 1 + 1e-12


def test_the_ellipsoid_of_points_on_one_is_that_one(rng):
    turn, semi_axes = special_ortho_group.rvs(3, random_state=1), np.array([3.0, 2.0, 1.0])
    r = rng.normal(size=(3000, 3))
    r /= np.linalg.norm(r, axis=1)[:, None]
    position = r * semi_axes @ turn.T
    found = bounding_ellipsoid(np.vstack([position, 0.9 * position]), tolerance=1e-5)
    assert found.semi_axes == pytest.approx(semi_axes, rel=2e-3)
    assert found.volume <= 8 * np.pi * (1 + 1e-5)


def test_the_ellipsoid_of_spheres_holds_them():
    """A single sphere is its own ellipsoid. For two equal spheres the smallest enclosing ellipsoid is known:
    a minimum over ellipsoids of revolution around both."""
    one = bounding_ellipsoid([[1.0, 2.0, 3.0]], 0.5, tolerance=1e-6)
    assert one.semi_axes == pytest.approx([0.5] * 3, rel=1e-6)
    two = bounding_ellipsoid([[-2.0, 0, 0], [2.0, 0, 0]], 0.5, tolerance=1e-4)

    def volume(across):
        """Volume of the ellipsoid of revolution that touches both spheres: a point at angle t of the right
        sphere lies on it, and no point lies outside."""
        t = np.linspace(0, np.pi / 2, 2001)
        x, y = 2 + 0.5 * np.cos(t), 0.5 * np.sin(t)
        along = np.max(x / np.sqrt(np.maximum(1 - (y / across) ** 2, 1e-300)))
        return along * across**2

    across = np.linspace(0.501, 1.5, 2000)
    least = min(volume(b) for b in across)
    assert two.volume == pytest.approx(4 / 3 * np.pi * least, rel=1.1e-4)
    assert two.semi_axes[1] == pytest.approx(two.semi_axes[2], rel=1e-3)
    assert two.centre == pytest.approx([0, 0, 0], abs=1e-3)


def test_points_on_all_spheres_are_in_the_ellipsoid(rng):
    """Also if one sphere is much larger than the others."""
    position, radius = ball(rng, 400) * (5, 3, 2), np.append(np.full(399, 0.1), 2.0)
    found = bounding_ellipsoid(position, radius, tolerance=1e-4)
    u = rng.normal(size=(400, 2000, 3))
    surface = position[:, None] + radius[:, None, None] * u / np.linalg.norm(u, axis=2)[..., None]
    levels = found.level(surface.reshape(-1, 3))
    assert 0.99 < levels.max() <= 1 + 1e-9
    inner = bounding_ellipsoid(position)
    assert inner.volume < found.volume


def test_points_without_an_ellipsoid_are_refused():
    flat = np.column_stack([np.random.default_rng(1).normal(size=(10, 2)), np.zeros(10)])
    for measure in (bounding_ellipsoid, hull_volume):
        with pytest.raises(InputError, match="particles must be spheres, or points not all in a plane"):
            measure(flat)
        with pytest.raises(InputError, match="particles must be at least one"):
            measure(np.empty((0, 3)))
    assert hull_volume(flat, 0.1) > 0
    with pytest.raises(InputError, match="tolerance must be above 0 and below 1"):
        bounding_ellipsoid(flat, 0.1, tolerance=0.0)


def test_hulls(rng):
    """For a cube with edges L, and for spheres at its corners: L^3 + 6 L^2 R + 3 pi L R^2 + 4/3 pi R^3."""
    corners = np.vstack([CORNERS, 0.3 * ball(rng, 100)])
    assert hull_volume(corners) == pytest.approx(8.0, rel=1e-12)
    radius = 0.25
    expected = 8 + 24 * radius + 6 * np.pi * radius**2 + 4 / 3 * np.pi * radius**3
    assert hull_volume(corners, radius) == pytest.approx(expected, rel=2e-3)
    assert hull_volume([[3.0, 0, 0]], 2.0) == pytest.approx(32 / 3 * np.pi, rel=1e-9)
    # A large sphere in the middle reaches beyond the small ones.
    sizes = np.append(np.full(107, 1e-3), 1.7)
    assert hull_volume(corners, sizes) > 4 / 3 * np.pi * 1.7**3
    assert hull_density(corners, np.full(108, 2.0), radius) == pytest.approx(216 / expected, rel=2e-3)


@pytest.mark.parametrize("time", [0.0, 2.7])
def test_voronoi_cells_fill_a_periodic_box(rng, time):
    """A sheared box has the same volume; each cell is the hull of its corners among many images."""
    domain = ShearedBox(low=(0, 0, 0), high=(3, 4, 5), rate=0.1)
    position = rng.uniform(size=(200, 3)) ** 2 * (3, 4, 5)
    volumes = voronoi_volumes(position, periodic_sides(domain, time))
    assert volumes.sum() == pytest.approx(60.0, rel=1e-12)
    # Points are crowded in a corner, so that cells elsewhere are wide.
    crowded = rng.uniform(size=(400, 3)) ** 6 * (3, 4, 5)
    assert voronoi_volumes(crowded, periodic_sides(domain, time)).sum() == pytest.approx(60.0, rel=1e-12)
    few = rng.uniform(size=(9, 3)) * (3, 4, 5)
    assert voronoi_volumes(few, (3, 4, 5)).sum() == pytest.approx(60.0, rel=1e-12)


def test_voronoi_cells_fill_boxes_that_are_long_or_crowded(rng):
    """A cell extends at most half a side along each axis, so the first layer of images is enough, however far
    away the other points are. Points in a plane have no cells."""
    apart = np.column_stack([rng.uniform(size=(30, 2)), rng.uniform(4, 6, 30)])
    volumes = voronoi_volumes(apart, (1, 1, 10))
    assert volumes.sum() == pytest.approx(10.0, rel=1e-12)
    assert volumes.max() > 1
    layers = np.column_stack([rng.uniform(size=(18, 2)), 5 + 1e-3 * (np.arange(18) % 2)])
    assert voronoi_volumes(layers, (1, 1, 10)).sum() == pytest.approx(10.0, rel=1e-9)
    leaning = periodic_sides(ShearedBox(low=(0, 0, 0), high=(1, 10, 1), rate=0.1), 4.3)
    assert voronoi_volumes(apart[:, [0, 2, 1]], leaning).sum() == pytest.approx(10.0, rel=1e-12)
    rule = r"^particles must be points not all in a plane; received points in a plane$"
    with pytest.raises(InputError, match=rule):
        voronoi_volumes(apart * (1, 1, 0))
    with pytest.raises(InputError, match=r"^positions must be finite; received .*nan"):
        voronoi_volumes(apart * (1, 1, np.nan), (1, 1, 10))


def tiled(points, sides, layers):
    """Volumes of cells by SciPy's hulls, with ``layers`` layers of images along each axis."""
    turns = np.stack(np.meshgrid(*(np.arange(-n, n + 1) for n in layers), indexing="ij"), -1).reshape(-1, 3)
    turns = turns[np.argsort(np.abs(turns).sum(axis=1), kind="stable")]
    diagram = Voronoi(np.vstack([points + turn * np.array(sides) for turn in turns]))
    regions = [diagram.regions[region] for region in diagram.point_region[: len(points)]]
    return [ConvexHull(diagram.vertices[region]).volume for region in regions]


def test_one_layer_of_images_is_enough_in_a_box_that_is_far_longer_than_wide(rng):
    """Points in one end of a long box; and a flat layer, whose cells are the two-dimensional ones."""
    points = rng.uniform(size=(30, 3))
    volumes = voronoi_volumes(points, (1, 1, 30))
    np.testing.assert_allclose(volumes, tiled(points, (1, 1, 30), (3, 3, 1)), rtol=1e-9)
    long = np.column_stack([rng.uniform(size=(10, 2)), rng.uniform(0, 0.01, 10)])
    assert voronoi_volumes(long, (1, 1, 1000)).sum() == pytest.approx(1000.0, rel=1e-9)
    flat = np.column_stack([rng.uniform(size=(60, 2)), np.full(60, 0.3)])
    volumes = voronoi_volumes(flat, (1, 1, 7))
    np.testing.assert_allclose(volumes, tiled(flat, (1, 1, 7), (2, 2, 1)), rtol=1e-9)


def test_voronoi_cells_of_a_lattice_and_those_that_are_open():
    sites = np.stack(np.meshgrid(*3 * [np.arange(5.0)], indexing="ij"), -1).reshape(-1, 3)
    sites += 1e-6 * np.random.default_rng(1).normal(size=sites.shape)
    volumes = voronoi_volumes(sites)
    inner = np.all((sites > 0.5) & (sites < 3.5), axis=1)
    np.testing.assert_allclose(volumes[inner], 1.0, rtol=1e-4)
    assert np.isnan(volumes[0])
    layer = voronoi_volumes(sites, (5.0, 5.0, 0.0))
    middle = (sites[:, 2] > 0.5) & (sites[:, 2] < 3.5)
    np.testing.assert_allclose(layer[middle], 1.0, rtol=1e-4)
    with pytest.raises(InputError, match="particles must be more than 4"):
        voronoi_volumes(sites[:4])


def test_voronoi_volumes_by_shell(rng):
    """For a lattice. A shell that is too thin to contain the ellipsoid of any cell has no mean."""
    sites = np.stack(np.meshgrid(*3 * [np.arange(-7.0, 8)], indexing="ij"), -1).reshape(-1, 3)
    sites += 1e-4 * rng.normal(size=sites.shape)
    whole = Ellipsoid(np.zeros(3), np.array([6.0, 5.5, 5.0]), np.eye(3))
    found = voronoi_by_shell(sites, whole, 2)
    np.testing.assert_allclose(found.volume, 1.0, rtol=2e-3)
    inner = (whole.level(sites) < 0.5 ** (1 / 3)).sum()
    assert found.number[0] == inner
    assert inner == pytest.approx(whole.volume / 2, rel=0.1)
    assert found.left_out[0] == 0
    assert found.left_out[1] > 0
    assert (found.number + found.left_out).sum() == (whole.level(sites) < 1).sum()
    assert np.isnan(voronoi_by_shell(sites, whole, 9).volume[-1])
    wide = Ellipsoid(whole.centre, 2 * whole.semi_axes, whole.axes)
    np.testing.assert_allclose(voronoi_by_shell(2 * sites, wide, 2).volume, 8.0, rtol=2e-3)
