"""Outlines of walls in pictures lie on their shapes and follow their motions."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.effects.contact.grains import USUAL
from tests.scenes import scene
from tisim import Material, geometry
from tisim.effects import Fixed, Granular, Oscillation, Rotation, Servo, Translation, Walls
from tisim.plotting.cloud import start_and_end
from tisim.plotting.movie import walls_of_all
from tisim.plotting.walls import outline, outlines, placed

TOWARDS = np.array([0.0, -0.8, 0.6])
LOW, HIGH = np.zeros(3), np.ones(3)
MOTIONS = (
    Fixed(),
    Translation(velocity=(1.0, 2.0, 3.0)),
    Translation(velocity=(1.0, 2.0, 3.0), begin=0.3),
    Oscillation(amplitude=(0.0, 0.1, 0.2), frequency=3.0, phase=0.5),
    Rotation(rate=(0.3, -1.0, 2.0), centre=(1.0, 0.5, 0.0)),
)


def among(*walls):
    """A scene of one grain in these walls."""
    return scene(
        [[0.5] * 3], np.zeros((1, 3)), (Granular(), *walls), 0.1, materials={"grain": Material(**USUAL)}
    )


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
    lines = outlines(among(Walls(planes=planes)), 0.0, LOW, HIGH, TOWARDS)
    assert len(lines) == 5
    points = np.concatenate(lines)
    assert (points.min(axis=0), points.max(axis=0)) == (
        pytest.approx([0, 0, 0], abs=1e-6), pytest.approx([1, 1, 1 + 0.1 * 3**0.5], abs=1e-6),
    )  # fmt: skip
    for (point, normal), line in zip(faces, lines, strict=True):
        np.testing.assert_allclose((line - point) @ normal, 0, atol=1e-9)
        assert len(line) == 5
    assert outlines(among(Walls(planes=[geometry.Plane(point=(0, 0, -9))])), 0.0, LOW, HIGH, TOWARDS) == []


def test_rims_and_silhouettes_lie_on_their_shapes():
    cylinder = geometry.CylindricalSurface(start=(0, 0, 0), end=(0, 0, 2), radius=0.5)
    *rims, left, right = outline(cylinder, TOWARDS)
    for rim, height in zip(rims, (0, 2), strict=True):
        np.testing.assert_allclose(np.linalg.norm(rim[:, :2], axis=1), 0.5)
        np.testing.assert_allclose(rim[:, 2], height, atol=1e-12)
    # Seen from -y it ends at x = 0.5 on both sides.
    np.testing.assert_allclose(sorted([left[0, 0], right[0, 0]]), [-0.5, 0.5])
    (ring,) = outline(geometry.SphericalSurface(centre=(1, 2, 3), radius=0.3), TOWARDS)
    np.testing.assert_allclose(np.linalg.norm(ring - [1, 2, 3], axis=1), 0.3)
    np.testing.assert_allclose((ring - [1, 2, 3]) @ TOWARDS, 0, atol=1e-12)
    assert len(outline(geometry.BoxSurface(high=(1, 2, 3)), TOWARDS)) == 12
    cone = geometry.ConicalSurface(end=(0, 0, 1), start_radius=0.0, end_radius=1.0)
    assert len(outline(cone, TOWARDS)) == 3
    sheet = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1.0]])
    flat = geometry.TriangulatedSurface(vertices=sheet, faces=[(0, 1, 2), (0, 2, 3)])
    assert len(outline(flat, TOWARDS)) == 4
    tent = geometry.TriangulatedSurface(vertices=sheet, faces=[(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    assert len(outline(tent, TOWARDS)) == 8


def test_walls_in_a_picture_are_in_place():
    """A moving disc is at another place at the end; walls moved by forces and distant walls are left out."""
    disc = geometry.Disc(centre=(0.5, 0.5, 0), radius=0.5)
    goes = Walls(name="goes", discs=[disc], motion=Translation(velocity=(0, 0, 0.4)))
    made = among(
        goes,
        Walls(name="lid", discs=[disc], motion=Servo(force=1.0, limit=0.1)),
        Walls(name="far", discs=[geometry.Disc(centre=(0, 0, 99), radius=1.0)]),
    )
    (line,) = outlines(made, 1.0, LOW, HIGH, TOWARDS)
    np.testing.assert_allclose(line[:, 2], 0.4)
    start = made.start()
    figure = start_and_end((start, start), (0.0, 1.0), made)
    heights = [axis.lines[0].get_ydata().mean() for axis in figure.axes[:2]]
    assert len(figure.axes[0].lines) == len(start_and_end((start, start), (0, 1), among()).axes[0].lines) + 1
    assert heights[1] > heights[0]


def test_walls_in_a_movie_are_in_place_at_each_frame():
    disc = geometry.Disc(centre=(0.5, 0.5, 0), radius=0.5)
    shakes = Oscillation(amplitude=(0, 0, 0.4), frequency=1.0)
    made = among(Walls(discs=[disc], motion=shakes))
    frames = SimpleNamespace(scene=made, times=np.array([0.0, 0.25, 0.5, 1.0]))
    heights = [line[:, 1].mean() for line in walls_of_all(frames, made.start())]
    assert len(heights) == 4
    assert heights[1] > max(heights[0], heights[2], heights[3]) + 0.1
