"""Distances from bodies and walls at the faces of a grid, and the paths through pores."""

import numpy as np
import pytest

from tisim.sources import SolidCylinder, SolidSphere
from tisim.sources.pore_flow.connectivity import through_paths
from tisim.sources.pore_flow.no_slip import NoSlip
from tisim.sources.pore_flow.solids import Grid

AXIS = (0.48, -0.6, 0.64)


def grid(column="none", axis=2, cells=(9, 7, 8)):
    return Grid(np.array([1.0, -2.0, 0.5]), np.array([0.2, 0.25, 0.15]), cells, column, axis)


@pytest.mark.parametrize("round_ends", [False, True])
def test_distances_from_a_cylinder_are_those_from_its_surface(round_ends, rng):
    """Compared with many points of its surface."""
    body = SolidCylinder((0.3, 0.1, -0.2), AXIS, 0.4, 1.2, round_ends)
    n = np.array(AXIS)
    e = np.cross(n, [1.0, 0, 0]) / np.linalg.norm(np.cross(n, [1.0, 0, 0]))
    f = np.cross(n, e)
    turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    circle = np.cos(turn)[:, None] * e + np.sin(turn)[:, None] * f
    side = (0.4 * circle[:, None] + np.linspace(-0.6, 0.6, 80)[:, None] * n).reshape(-1, 3)
    caps = []
    for part in np.linspace(0, 1, 40):
        across, up = (np.sin(part * np.pi / 2), np.cos(part * np.pi / 2)) if round_ends else (part, 0.0)
        for way in (-1, 1):
            caps.append(0.4 * across * circle + way * (0.6 + 0.4 * up) * n)
    surface = body.centre + np.concatenate([side, *caps])
    points = body.centre + rng.uniform(-1.4, 1.4, (300, 3))
    found = body.distances(points)
    nearest = np.linalg.norm(points[:, None] - surface, axis=-1).min(axis=1)
    np.testing.assert_allclose(abs(found), nearest, atol=0.02)
    out = points - body.centre
    along, rho = out @ n, np.linalg.norm(np.cross(out, n), axis=1)
    foot = np.linalg.norm(out - np.clip(along, -0.6, 0.6)[:, None] * n, axis=1)
    inside = foot < 0.4 if round_ends else (rho < 0.4) & (abs(along) < 0.6)
    np.testing.assert_array_equal(found < 0, inside)
    low, high = body.extent()
    np.testing.assert_allclose(low, surface.min(axis=0), atol=5e-3)
    np.testing.assert_allclose(high, surface.max(axis=0), atol=5e-3)
    assert body.width == pytest.approx(0.8)


def test_near_bodies_the_grid_has_the_distance_from_the_nearest_image():
    """Also for bodies longer than the box, and far outside of it."""
    bodies = [SolidCylinder((1.3, 7.1, 0.6), AXIS, 0.2, 4.0), SolidSphere((-3.0, -2.1, 40.0), 0.3)]
    mesh = grid()
    sides = mesh.spacing * mesh.shape
    for component in range(3):
        found = mesh.distances(component, bodies)
        places = np.stack(np.meshgrid(*mesh.coordinates(component), indexing="ij"), axis=-1)
        expected = np.full(found.shape, np.inf)
        for body in bodies:
            centre = np.round((np.array(body.centre) - places.mean(axis=(0, 1, 2))) / sides)
            for shift in np.ndindex(9, 9, 9):
                moved = places + sides * (centre + np.array(shift) - 4)
                expected = np.minimum(expected, body.distances(moved))
        near = expected < mesh.spacing.min()
        np.testing.assert_allclose(found[near], expected[near], atol=1e-12)
        assert (found[~near] > 0.9 * mesh.spacing.min()).all()


def test_walls_are_at_the_faces_of_the_box():
    mesh = grid("duct", axis=1)
    assert mesh.walled == (True, False, True)
    assert mesh.shape[1] == 7
    assert mesh.shape[0] >= 10
    assert mesh.shape[2] >= 9
    x, _, z = mesh.coordinates(1)
    found = mesh.distances(1, [])
    for i, a in enumerate(x):
        for k, b in enumerate(z):
            beside = min(a - 1.0, 2.8 - a, b - 0.5, 1.7 - b)
            # Cells in the wall are nearer to one of both sides.
            again = max(a - 1.0 - mesh.shape[0] * 0.2, 2.8 - a), max(b - 0.5 - mesh.shape[2] * 0.15, 1.7 - b)
            expected = beside if beside > 0 else min(min(c for c in again), 0)
            if beside > 0:
                assert found[i, 3, k] == pytest.approx(expected)
            else:
                assert found[i, 3, k] <= 0
    assert mesh.distances(0, [])[0].max() == pytest.approx(0, abs=1e-12)


def test_a_tube_touches_the_faces_of_the_box():
    mesh = Grid(np.zeros(3), np.full(3, 0.1), (10, 4, 10), "tube", 1)
    x, _, z = mesh.coordinates(1)
    found = mesh.distances(1, [])[:10, 0, :10]
    expected = 0.5 - np.hypot(x[:10, None] - 0.5, z[None, :10] - 0.5)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert (mesh.distances(1, [])[10:] < 0).all()


def blocked(*faces, shape=(3, 3, 3)):
    solid = np.zeros((3, *shape), bool)
    for face in faces:
        solid[face] = True
    return solid


def test_paths_lead_through_open_space_along_all_axes():
    paths = through_paths(blocked())
    assert np.linalg.matrix_rank(paths) == 3


def test_a_plane_blocks_one_axis_and_closed_cells_all():
    paths = through_paths(blocked((0, 1)))
    assert np.linalg.matrix_rank(paths) == 2
    assert (paths[:, 0] == 0).all()
    assert through_paths(np.ones((3, 3, 3, 3), bool)).shape == (0, 3)


def test_a_channel_may_close_on_itself_after_several_periods():
    """A wall with a door at y = 0 in the box of x, and a wall along y that only opens elsewhere: the fluid
    climbs by one period of y for each of x."""
    solid = np.ones((3, 4, 4, 1), bool)
    for i in range(4):
        # From cell (i, i) one step along x and one along y.
        solid[0, (i + 1) % 4, i, 0] = False
        solid[1, (i + 1) % 4, (i + 1) % 4, 0] = False
    paths = through_paths(solid)
    assert len(paths) > 0
    assert (paths[:, 0] == paths[:, 1]).all()
    assert (paths[:, 2] == 0).all()


def test_faces_next_to_a_wall_feel_it_by_its_distance():
    """A wall at 0.3 h beyond a face: kappa = (1/0.3 - 1)/h^2; one nearer than 0.02 h is solid."""
    h = np.array([0.5, 0.5, 0.5])
    depth = np.full((6, 1, 1), 1.0)
    depth[:, 0, 0] = [0.15, 0.65, 1.0, 1.0, 0.005, -0.35]
    far = np.full((6, 1, 1), 1.0)
    walls = NoSlip.at([far, depth, far], h)
    assert walls.counts == (0, 3, 0)
    np.testing.assert_array_equal(walls.index - 6, [0, 4, 5])
    assert walls.compliance[0] == pytest.approx(0.25 / (1 / 0.3 - 1))
    np.testing.assert_array_equal(walls.compliance[1:], 0)
    assert not walls.inside().any()
