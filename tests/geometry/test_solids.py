"""Solids: containment, distances and uniform filling, against NumPy and samples."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.stats import qmc

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.geometry import round_box
from tisim.geometry.cylinder import cylinder_distance
from tisim.geometry.directions import across, along_axis
from tisim.geometry.sphere import ball_distance

HALVES = {"box": (0.5, 0.8, 0.3), "cylinder": (0.7, 0.7, 1.1), "ball": (0.9, 0.9, 0.9)}
"""m, half the sides of the box of each shape."""
SHAPES = tuple(enumerate(HALVES))
POINTS = 4096
RADIUS, HALF_LENGTH = 0.5, 0.7
"""m, for the solids whose distances are measured."""


@in_taichi_thread
@ti.kernel
def fill(
    u: ti.types.ndarray(),
    away: ti.types.ndarray(),
    halves: ti.types.ndarray(),
    inside: ti.types.ndarray(),
    places: ti.types.ndarray(),
    volumes: ti.types.ndarray(),
):
    for i in range(u.shape[0]):
        for m, shape in ti.static(SHAPES):
            half = ti.Vector([halves[m, 0], halves[m, 1], halves[m, 2]])
            far = ti.Vector([away[m, i, 0], away[m, i, 1], away[m, i, 2]])
            place = round_box.point(shape, half, ti.Vector([u[i, 0], u[i, 1], u[i, 2]]))
            inside[m, i] = round_box.contains(ti.static(round_box.ROUND[shape]), half, far)
            for k in ti.static(range(3)):
                places[m, i, k] = place[k]
            if i == 0:
                volumes[m] = round_box.volume(shape, 2.0 * half)


@in_taichi_thread
@ti.kernel
def measure(r: ti.types.ndarray(), ball: ti.types.ndarray(), cylinder: ti.types.ndarray()):
    for i in range(r.shape[0]):
        place = ti.Vector([r[i, 0], r[i, 1], r[i, 2]])
        out, up = ti.Vector([place[0], place[1], 0.0]), ti.Vector([0.0, 0.0, 1.0])
        rho, side = out.norm(), ti.select(place[2] < 0.0, -1.0, 1.0)
        outward, end = out / ti.select(rho > 0.0, rho, 1.0), ti.abs(place[2]) - HALF_LENGTH
        ball[i, 0], normal = ball_distance(place, 0.0 * place, RADIUS)
        cylinder[i, 0], slope = cylinder_distance(rho, outward, end, side * up, RADIUS)
        for k in ti.static(range(3)):
            ball[i, 1 + k], cylinder[i, 1 + k] = normal[k], slope[k]


def within(shape, away):
    """Whether points are in a shape, from their distance to its axis or centre."""
    half = np.array(HALVES[shape])
    if shape == "ball":
        return np.linalg.norm(away, axis=-1) <= half[0]
    if shape == "cylinder":
        return (np.linalg.norm(away[..., :2], axis=-1) <= half[0]) & (np.abs(away[..., 2]) <= half[2])
    return (np.abs(away) <= half).all(axis=-1)


@pytest.fixture(scope="module")
def filled():
    """Points in slightly more than each box and whether they are inside, points that fill the shape, and its
    volume."""
    u, halves = qmc.Sobol(3, rng=1).random(POINTS), np.array(list(HALVES.values()))
    away = 1.2 * halves[:, None] * (2 * qmc.Sobol(3, rng=2).random(POINTS) - 1)
    # A point on the surface, one beyond it, and one beyond an end that is not round.
    away[:, :3] = halves[:, None] * np.array([[1, 0, 0], [-1 - 1e-12, 0, 0], [0, 0, 1 + 1e-12]])
    inside, places, volumes = np.zeros((3, POINTS), np.int32), np.zeros((3, POINTS, 3)), np.zeros(3)
    fill(u, away, halves, inside, places, volumes)
    return away, inside.astype(bool), places, volumes


@pytest.mark.parametrize(("m", "shape"), SHAPES)
def test_containment_agrees_in_kernels_and_python(filled, m, shape):
    away, inside = filled[0][m], filled[1][m]
    np.testing.assert_array_equal(inside, within(shape, away))
    np.testing.assert_array_equal(inside[:3], [True, False, False])
    half, rounded = np.array(HALVES[shape]), np.array(round_box.ROUND[shape], float)
    np.testing.assert_array_equal(round_box.contains(rounded, half, away.T), inside)


@pytest.mark.parametrize(("m", "shape"), SHAPES)
def test_the_volume_is_the_fraction_of_points_inside(filled, m, shape):
    """The points lie in a box that is a fifth wider; 4096 of them give the volume to half a percent."""
    _, inside, _, volumes = filled
    sides = 2 * np.array(HALVES[shape])
    assert volumes[m] == pytest.approx(inside[m].mean() * np.prod(1.2 * sides), rel=5e-3)
    assert round_box.volume(shape, sides) == volumes[m]


@pytest.mark.parametrize(("m", "shape"), SHAPES)
def test_a_shape_is_filled_evenly(filled, m, shape):
    """As uniform as points drawn in the box and rejected outside the shape: first and second moments."""
    places, half = filled[2][m], np.array(HALVES[shape])
    assert within(shape, places * (1 - 1e-12)).all()
    tried = half * (2 * qmc.Sobol(3, rng=3).random(8 * POINTS) - 1)
    kept = tried[within(shape, tried)]
    np.testing.assert_allclose(places.mean(axis=0), 0.0, atol=5e-3)
    np.testing.assert_allclose((places**2).mean(axis=0), (kept**2).mean(axis=0), rtol=1e-2)
    np.testing.assert_allclose(np.cov(places.T)[np.triu_indices(3, 1)], 0.0, atol=5e-3)
    # An eighth of the points lie in the shape of half the size.
    assert within(shape, 2 * places).mean() == pytest.approx(1 / 8, rel=2e-2)


def surfaces(n=400):
    """Samples of the surfaces of the ball and the cylinder, m, and their largest spacing."""
    turn = np.linspace(0, 2 * np.pi, n, endpoint=False)[:, None]
    tilt = np.linspace(0, np.pi, n)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    on_ball = RADIUS * np.concatenate(
        [np.sin(tilt)[:, None] * ring, np.tile(np.cos(tilt)[:, None], (n, 1, 1))], axis=-1
    )
    lines = [(np.full(n, RADIUS), np.linspace(-HALF_LENGTH, HALF_LENGTH, n))]
    lines += [(np.linspace(0, RADIUS, n), np.full(n, z)) for z in (-HALF_LENGTH, HALF_LENGTH)]
    on_cylinder = [
        np.concatenate([rho[:, None] * ring, np.tile(z[:, None], (n, 1, 1))], axis=-1) for rho, z in lines
    ]
    return on_ball.reshape(-1, 3), np.concatenate(on_cylinder).reshape(-1, 3), 2 * np.pi * RADIUS / n


def test_distances_of_solids_agree_with_surface_samples():
    """The distance is negative inside; the nearest point lies along the normal."""
    points = np.random.default_rng(4).uniform(-1.2, 1.2, (500, 3))
    # The centre, and points on the axis within and beyond.
    points[:3] = [[0, 0, 0], [0, 0, 0.3], [0, 0, -1.0]]
    ball, cylinder = np.zeros((500, 4)), np.zeros((500, 4))
    measure(points, ball, cylinder)
    on_ball, on_cylinder, apart = surfaces()
    rho, z = np.linalg.norm(points[:, :2], axis=1), np.abs(points[:, 2])
    in_ball, in_cylinder = np.linalg.norm(points, axis=1) < RADIUS, (rho < RADIUS) & (z < HALF_LENGTH)
    for out, samples, inner in ((ball, on_ball, in_ball), (cylinder, on_cylinder, in_cylinder)):
        distance, normal = out[:, 0], out[:, 1:]
        sampled = cKDTree(samples).query(points)[0]
        np.testing.assert_array_equal(distance < 0, inner)
        # From inside, on the axis of the cylinder, the distance is taken to the end, even if that is farther.
        axis = (rho == 0) & inner & (samples is on_cylinder)
        assert (np.abs(distance) <= sampled + 1e-12)[~axis].all()
        np.testing.assert_allclose(np.abs(distance)[~axis], sampled[~axis], atol=apart)
        np.testing.assert_allclose(distance[axis], z[axis] - HALF_LENGTH, rtol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-14)
        foot = points - distance[:, None] * normal
        assert cKDTree(samples).query(foot)[0].max() < apart


@pytest.mark.parametrize("axis", [(0.0, 0.0, 3.0), (-2.0, 1e-3, 0.5), (1.0, -4.0, 8.0)])
def test_points_are_turned_with_their_axis(axis):
    unit = np.array(axis) / np.linalg.norm(axis)
    frame = np.stack([*across(unit), unit])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    points = np.random.default_rng(5).normal(size=(20, 3))
    turned = along_axis(points, axis)
    np.testing.assert_allclose(turned @ turned.T, points @ points.T, atol=1e-13)
    np.testing.assert_allclose(turned @ unit, points[:, 2], atol=1e-14)
