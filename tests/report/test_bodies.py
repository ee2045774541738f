"""Walls are drawn as they are: areas, rims and positions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from tests.report.conftest import growing_packing, particles
from tisim import Box, Material, Scene
from tisim.effects import (
    Confinement,
    Granular,
    HardRods,
    Oscillation,
    Rotation,
    Servo,
    Translation,
    Walls,
)
from tisim.effects.walls.placement import placed, placed_container
from tisim.geometry import (
    BoxSurface,
    ConicalSurface,
    CylindricalSurface,
    Disc,
    Plane,
    SphericalContainer,
    SphericalSurface,
    TriangulatedSurface,
)
from tisim.operators import ReflectingWalls
from tisim.report.bodies import bodies, container
from tisim.shapes import SpherocylinderShape
from tisim.steppers import MechanicalContraction

SQUARE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
LOW, HIGH = np.full(3, -1.0), np.full(3, 1.0)


def walled(**walls):
    """A scene with one body of walls."""
    glass = Material(young=1e7, poisson=0.25, restitution=0.5, friction=0.5)
    return Scene(
        particles=particles(1), materials={"glass": glass}, effects=(Granular(), Walls(**walls)), duration=1.0
    )


def area(drawn):
    """The area of the triangles of a mesh, m^2."""
    a, b, c = (drawn.vertices[drawn.triangles[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


@pytest.mark.parametrize(
    ("walls", "expected", "lines"),
    [
        ({"discs": [Disc(radius=0.5)]}, np.pi * 0.25, 96),
        ({"cylinders": [CylindricalSurface(end=(0, 0.0, 2.0), radius=0.5)]}, 2 * np.pi, 192),
        ({"cylinders": [CylindricalSurface(end=(0, 0.0, 2.0), radius=0.5, closed=True)]}, 2.5 * np.pi, 192),
        (
            {"cones": [ConicalSurface(end=(0, 0, 0.4), start_radius=0.0, end_radius=0.3)]},
            np.pi * 0.3 * 0.5, 96,
        ),
        ({"spheres": [SphericalSurface(radius=0.5)]}, np.pi, 0),
        ({"boxes": [BoxSurface(high=(1, 2, 3))]}, 22.0, 12),
        ({"surface": TriangulatedSurface(vertices=SQUARE, faces=((0, 1, 2), (0, 2, 3)))}, 1.0, 4),
    ],
)  # fmt: skip
def test_areas_and_rims(walls, expected, lines):
    (body,) = bodies(walled(**walls), np.zeros(1), {}, LOW, HIGH)
    assert area(body.mesh) == pytest.approx(expected, rel=6e-3)
    assert len(body.mesh.lines) == lines


def test_planes_end_at_each_other():
    """Five planes make an open box; its walls end slightly above the particles."""
    faces = (((0, 0, 0), (1, 0, 0)), ((1, 0, 0), (-1, 0, 0)), ((0, 0, 0), (0, 1, 0)), ((0, 1, 0), (0, -1, 0)))
    faces = (*faces, ((0, 0, 0), (0, 0, 1)))
    scene = walled(planes=[Plane(point=point, normal=normal) for point, normal in faces])
    (body,) = bodies(scene, np.zeros(1), {}, np.zeros(3), np.ones(3))
    top = 1 + 0.1 * np.sqrt(3)
    np.testing.assert_allclose(body.mesh.vertices.min(axis=0), 0, atol=1e-6)
    np.testing.assert_allclose(body.mesh.vertices.max(axis=0), [1, 1, top], atol=1e-6)
    assert area(body.mesh) == pytest.approx(1 + 4 * top)
    assert len(body.poses) == 0


@pytest.mark.parametrize(
    "motion",
    [
        Translation(velocity=(0.1, 0.2, -0.3), begin=0.25),
        Oscillation(amplitude=(0, 0, 0.1), frequency=0.7, phase=0.3),
        Rotation(rate=(0.3, 1.0, -2.0), centre=(0.1, 0.2, 0.3)),
    ],
)
def test_moving_walls_are_at_their_places(motion):
    scene = walled(discs=[Disc(radius=0.5, centre=(0.2, 0.1, 0.0))], motion=motion)
    times = np.array([0.0, 0.3, 0.9])
    (body,) = bodies(scene, times, {}, LOW, HIGH)
    for pose, time in zip(body.poses, times, strict=True):
        drawn = Turn.from_quat(pose[3:]).apply(body.mesh.vertices) + pose[:3]
        np.testing.assert_allclose(drawn, placed(motion, body.mesh.vertices, time), atol=1e-12)


def test_reflecting_walls_are_drawn_as_others_are():
    tube = CylindricalSurface(end=(0, 0.0, 2.0), radius=0.5)
    made = Scene(particles=particles(1), effects=(ReflectingWalls(cylinders=[tube]),), duration=1.0)
    (drawn,) = bodies(made, np.zeros(2), {}, LOW, HIGH)
    assert drawn.name == "reflecting_walls"
    assert area(drawn.mesh) == pytest.approx(2 * np.pi, rel=2e-3)
    assert len(drawn.poses) == 0


def test_a_servo_is_where_its_recorded_travel_puts_it():
    scene = walled(discs=[Disc(radius=0.5)], motion=Servo(force=1.0, direction=(0, 0, -2.0), limit=0.1))
    (body,) = bodies(scene, np.zeros(2), {"walls": np.array([0.0, 0.25])}, LOW, HIGH)
    np.testing.assert_allclose(body.poses[:, :3], [[0, 0, 0], [0, 0, -0.25]])


def test_a_container_grows_with_its_bodies():
    """It is drawn as at the last frame; factors and translations lead to its walls in all others."""
    made, states = growing_packing()
    (last, *_), drawn = [placed_container(made, states[-1])], container(made, states)
    assert area(drawn.mesh) == pytest.approx(np.pi * 0.008 * 0.02, rel=2e-3)
    np.testing.assert_allclose(drawn.stretches, [[0.25, 0.25, 1], [1, 1, 1], [1, 1, 1]], rtol=1e-12)
    for state, by, pose in zip(states, drawn.stretches, drawn.poses, strict=True):
        found = Turn.from_quat(pose[3:]).apply(by * drawn.mesh.vertices) + pose[:3]
        now = placed_container(made, state) or placed_container(made, states[-1])
        expected = np.unique(now.triangles.reshape(-1, 3), axis=0)
        apart = np.linalg.norm(found[:, None] - expected, axis=2)
        assert apart.min(axis=0).max() < 1e-12
        assert apart.min(axis=1).max() < 1e-12
    ends = drawn.places()
    assert np.ptp(ends[: len(ends) // 2], axis=0)[0] == pytest.approx(0.002)
    assert np.ptp(ends[len(ends) // 2 :], axis=0)[0] == pytest.approx(0.008)
    np.testing.assert_allclose(np.ptp(last.triangles.reshape(-1, 3), axis=0), [0.008, 0.008, 0.02])


def test_a_container_at_rest_has_no_poses_and_one_without_bodies_is_not_drawn():
    rods = HardRods(rods=(SpherocylinderShape(length=0.0, diameter=0.002),))
    made = Scene(
        particles=particles(1), effects=(rods, Confinement(container=SphericalContainer())),
        domain=Box(low=(-1,) * 3, high=(1,) * 3, periodic=(False,) * 3), duration=1.0,
        stepper=MechanicalContraction(),
    )  # fmt: skip
    assert len(container(made, [{"radius": np.ones(1), "shape": np.zeros(1, int)}]).poses) == 0
    assert container(made, [{"radius": np.ones(0)}]) is None
    assert (
        container(walled(discs=[Disc(radius=0.5)]), [{"radius": np.ones(1), "shape": np.zeros(1, int)}])
        is None
    )
