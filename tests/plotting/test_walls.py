"""Walls in pictures and exports: triangles on their shapes, which follow the motions of bodies."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.effects.contact.grains import USUAL
from tests.report.conftest import growing_packing
from tests.scenes import scene
from tisim import Material, geometry
from tisim.effects import Fixed, Granular, Oscillation, Rotation, Servo, Translation, Walls
from tisim.effects.walls.placement import MARGIN, placed, placed_walls
from tisim.geometry.tessellation import FACETS_AROUND, sharp_edges, tessellated
from tisim.operators import ReflectingWalls
from tisim.plotting.look import USUAL as USUAL_LOOK
from tisim.plotting.movie import _scales
from tisim.plotting.scenery import scenery

CORNERS = np.array([[0.0, 0, 0], [1, 1, 1]])
MOTIONS = (
    Fixed(),
    Translation(velocity=(1.0, 2.0, 3.0)),
    Translation(velocity=(1.0, 2.0, 3.0), begin=0.3),
    Oscillation(amplitude=(0.0, 0.1, 0.2), frequency=3.0, phase=0.5),
    Rotation(rate=(0.3, -1.0, 2.0), centre=(1.0, 0.5, 0.0)),
)
DISC = geometry.Disc(centre=(0.5, 0.5, 0), radius=0.5)


def among(*walls):
    """A scene of one grain in these walls."""
    return scene(
        [[0.5] * 3], np.zeros((1, 3)), (Granular(), *walls), 0.1, materials={"grain": Material(**USUAL)}
    )


def size(triangles):
    """The total area of triangles, m^2."""
    sides = triangles[:, 1:] - triangles[:, :1]
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: motion.kind())
def test_points_of_a_body_follow_its_motion(motion, rng):
    """Each point moves with the velocity of its motion, and the inverse map returns it."""
    place, t, h = rng.normal(size=(5, 3)), 0.7, 1e-5
    there = placed(motion, place, t)
    np.testing.assert_allclose(placed(motion, there, -t), place, atol=1e-12)
    moving = (placed(motion, place, t + h) - placed(motion, place, t - h)) / (2 * h)
    expected = {
        "fixed": lambda: 0 * place,
        "translation": lambda: np.tile(motion.velocity, (5, 1)),
        "oscillation": lambda: np.tile(
            6 * np.pi * np.cos(6 * np.pi * t + 0.5) * np.array(motion.amplitude), (5, 1)
        ),
        "rotation": lambda: np.cross(motion.rate, there - motion.centre),
    }[motion.kind()]()
    np.testing.assert_allclose(moving, expected, atol=1e-6)


def test_a_gate_rests_until_it_begins_to_move(rng):
    place, gate = rng.normal(size=(5, 3)), Translation(velocity=(1.0, 0.0, 2.0), begin=0.5)
    np.testing.assert_array_equal(placed(gate, place, 0.4), place)
    np.testing.assert_allclose(placed(gate, place, 0.7) - place, np.tile([0.2, 0.0, 0.4], (5, 1)))


def test_planes_end_at_each_other_and_around_the_grains():
    """A box without a lid: five rectangles, which extend slightly beyond the grains on the open side."""
    faces = [((0, 0, 0), axis) for axis in np.eye(3)] + [((1, 1, 1), -axis) for axis in np.eye(3)[:2]]
    planes = [geometry.Plane(point=point, normal=tuple(normal)) for point, normal in faces]
    (body,) = placed_walls(among(Walls(planes=planes)).effects, 0.0, CORNERS)
    points = body.triangles.reshape(-1, 3)
    top = 1 + MARGIN * 3**0.5
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[0, 0, 0], [1, 1, top]], atol=1e-6)
    assert size(body.triangles) == pytest.approx(1 + 4 * top, rel=1e-6)
    assert len(body.edges) == 20
    far = Walls(planes=[geometry.Plane(point=(0, 0, -9))])
    assert not len(placed_walls(among(far).effects, 0.0, CORNERS)[0].triangles)


@pytest.mark.parametrize(
    ("shape", "area", "edges"),
    [
        (DISC, np.pi / 4, 2 * np.pi * 0.5),
        (geometry.SphericalSurface(centre=(1, 2, 3), radius=0.3), 4 * np.pi * 0.09, 0.0),
        (geometry.CylindricalSurface(start=(0, 0, 0), end=(1, 0, 2), radius=0.5), np.pi * 5**0.5, 2 * np.pi),
        (geometry.CylindricalSurface(end=(0, 0, 2), radius=0.5, closed=True), 2.5 * np.pi, 2 * np.pi),
        (geometry.ConicalSurface(end=(0, 0, 1), start_radius=0.0, end_radius=1.0), np.pi * 2**0.5, 2 * np.pi),
        (geometry.BoxSurface(high=(1, 2, 3)), 22.0, 24.0),
    ],
)
def test_triangles_lie_on_their_shapes(shape, area, edges):
    """Their corners lie on the surface, and areas and lengths of sharp edges approach the true ones."""
    triangles = tessellated(shape)
    np.testing.assert_allclose(shape.distances(triangles.reshape(-1, 3)), 0, atol=1e-12)
    assert size(triangles) == pytest.approx(area, rel=2e-3)
    lines = sharp_edges(triangles)
    assert np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum() == pytest.approx(edges, rel=2e-3)


def test_edges_of_a_mesh_are_its_rims_and_folds():
    sheet = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1.0]])
    flat = geometry.TriangulatedSurface(vertices=sheet, faces=[(0, 1, 2), (0, 2, 3)])
    assert len(sharp_edges(tessellated(flat))) == 4
    tent = geometry.TriangulatedSurface(vertices=sheet, faces=[(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    assert len(sharp_edges(tessellated(tent))) == 8


def test_walls_in_a_picture_are_in_place():
    """A moving disc is at another place at the end; a body moved by forces is where its travel says, and left
    out if that is not known; distant walls are left out."""
    made = among(
        Walls(name="goes", discs=[DISC], motion=Translation(velocity=(0, 0, 0.4))),
        Walls(name="lid", discs=[DISC], motion=Servo(force=1.0, limit=0.1)),
        Walls(name="far", discs=[geometry.Disc(centre=(0, 0, 99), radius=1.0)]),
    )
    start = made.start()
    around = [start]
    for time, measures, heights in (
        (0.0, {}, [0.0, 0.0]), (1.0, {}, [0.4]), (1.0, {"lid_travel": 0.3}, [0.4, -0.3]),
    ):  # fmt: skip
        walls = scenery(made, around, time, measures).walls
        np.testing.assert_allclose([one.corners[..., 2].mean() for one in walls], heights, atol=1e-12)


def test_reflecting_walls_are_in_the_picture():
    ball = geometry.SphericalSurface(centre=(0.5, 0.5, 0.5), radius=2.0)
    made = among(ReflectingWalls(spheres=[ball], planes=[geometry.Plane(point=(0, 0, 0))]))
    (wall,) = scenery(made, [made.start()], 0.0).walls
    away = np.linalg.norm(wall.corners - 0.5, axis=2)
    flat = (wall.corners[..., 2] == 0).all(axis=1)
    assert flat.any()
    np.testing.assert_allclose(away[~flat], 2.0)
    assert size(wall.corners[~flat]) == pytest.approx(16 * np.pi, rel=2e-3)


def test_the_container_of_a_packing_in_a_picture_grows_with_its_bodies():
    made, states = growing_packing()
    for state, wide in ((states[0], 0.002), (states[2], 0.008)):
        around = scenery(made, [states[2]], 0.0, now=state)
        (wall,) = around.walls
        corners = wall.corners.reshape(-1, 3)
        np.testing.assert_allclose(np.ptp(corners, axis=0), [wide, wide, 0.02])
        np.testing.assert_allclose(corners.mean(axis=0), 0, atol=1e-4)
        # Beside the box, the circles at both ends.
        rims = around.edges[1]
        assert len(rims) == 2 * FACETS_AROUND
    assert not scenery(made, [states[2]], 0.0).walls
    assert not scenery(made, [states[2]], 0.0, now=states[1]).walls


def test_the_window_of_a_movie_contains_walls_at_each_frame():
    shakes = Oscillation(amplitude=(0, 0, 4.0), frequency=1.0)
    made = among(Walls(discs=[DISC], motion=shakes))

    class Seen(list):
        scene, times, measures = made, np.array([0.0, 0.25, 0.5]), {}

    frames = Seen([SimpleNamespace(arrays=made.start())] * 3)
    _, _, part = _scales(frames, USUAL_LOOK)
    still = Seen(frames[:1])
    still.times = frames.times[:1]
    _, _, less = _scales(still, USUAL_LOOK)
    assert part.bottom + part.height > less.bottom + less.height + 3
