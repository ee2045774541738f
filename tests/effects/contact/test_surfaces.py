"""Two-sided surfaces, rims, edges and seams: forces on grains against closed forms."""

import numpy as np
import pytest

from tests.effects.contact.surfaces import (
    POISSON,
    RADIUS,
    SHEET,
    TRIANGLES,
    WORLDS,
    YOUNG,
    beside,
    moving,
    run,
)
from tisim import Scene, geometry

E_STAR = YOUNG / (2 * (1 - POISSON**2))
SOFT = {"restitution": 0.5, "friction": 0.5}


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


WITHIN = {
    "sphere": {"spheres": (geometry.SphericalSurface(radius=1.0),)},
    "cylinder": {
        "cylinders": (geometry.CylindricalSurface(start=(0, -1, -1), end=(0, 1, 1), radius=1.0, closed=True),)
    },
    "cone": {
        "cones": (
            geometry.ConicalSurface(
                start=(0, 0, -1), end=(0, 0, 1), start_radius=0.3, end_radius=1.5, closed=True
            ),
        )
    },
    "silo": {
        "cylinders": (geometry.CylindricalSurface(start=(0, 0, 0), end=(0, 0, 1), radius=1.0),),
        "cones": (
            geometry.ConicalSurface(start=(0, 0, -1), end=(0, 0, 0), start_radius=0.2, end_radius=1.0),
        ),
        "discs": (geometry.Disc(centre=(0, 0, 1), radius=1.0), geometry.Disc(centre=(0, 0, -1), radius=0.2)),
    },
    "box": {"boxes": (geometry.BoxSurface(low=(-0.7, -1, -0.5), high=(0.5, 1, 0.8)),)},
}
BLOCKS = {
    "ball": {"spheres": (geometry.SphericalSurface(radius=0.5),)},
    "rod": {
        "cylinders": (
            geometry.CylindricalSurface(start=(0, -0.5, 0), end=(0, 0.5, 0), radius=0.4, closed=True),
        )
    },
    "ring": {"cylinders": (geometry.CylindricalSurface(start=(0, -0.1, 0), end=(0, 0.1, 0), radius=0.6),)},
    "tip": {
        "cones": (
            geometry.ConicalSurface(start=(0, 0, -0.5), end=(0, 0, 0.4), start_radius=0.5, end_radius=0.0),
        )
    },
    "brick": {"boxes": (geometry.BoxSurface(low=(-0.4, -0.3, -0.5), high=(0.4, 0.3, 0.5)),)},
    "coin": {"discs": (geometry.Disc(radius=0.5),)},
}


def test_a_scene_with_all_shapes_survives_a_file():
    """Including triangles, which are arrays; other triangles make another scene."""
    made = beside((0, 0, 0), (0, 0, 0), {})
    again = Scene.from_dict(made.to_dict())
    assert again.effects == made.effects
    assert again.digest() == made.digest()
    assert again.structure() == made.structure()
    other = geometry.TriangulatedSurface(vertices=2 * TRIANGLES.vertices, faces=TRIANGLES.faces)
    walls = made.effects[1].model_copy(update={"surface": other})
    effects = (made.effects[0], walls, made.effects[2])
    assert made.model_copy(update={"effects": effects}).structure() != made.structure()


@pytest.mark.slow
def test_a_ball_inside_a_shape_bounces_for_ever():
    """Along planes, curved faces, and in their corners, in which it may touch three at once."""
    rng = np.random.default_rng(1)
    scenes = [
        beside(tuple(0.1 * unit(rng)), tuple(4 * unit(rng)), shapes, steps=60_000)
        for shapes in WITHIN.values()
        for _ in range(2)
    ]
    for name, result in zip([name for name in WITHIN for _ in range(2)], run(scenes), strict=True):
        assert np.linalg.norm(result.state["position"]) < 1.9, name
        if not result.state["walls_touched"].any():
            assert moving(result.state) == pytest.approx(8.0, rel=2e-4), name
        assert moving(result.state) < 8.0 * (1 + 2e-4), name


@pytest.mark.slow
def test_a_ball_that_grazes_edges_gains_nothing():
    """A third of the shots hit an edge, a rim, or a tip; elastic grains keep their energy, others
    lose some."""
    rng = np.random.default_rng(3)
    shots, hits = [], 0
    for k in range(4 * WORLDS):
        away, law = unit(rng), {} if k % 2 else SOFT
        aim = 0.5 * unit(rng)
        place = 1.2 * away
        go = (aim - place) / np.linalg.norm(aim - place)
        spin = tuple(20 * unit(rng)) if law else None
        shapes = list(BLOCKS.values())[k % len(BLOCKS)]
        shots.append((law, beside(tuple(place), tuple(5 * go), shapes, law=law, spin=spin, steps=25_000)))
    for first in range(0, len(shots), WORLDS):
        part = shots[first : first + WORLDS]
        for (law, _), result in zip(part, run([made for _, made in part]), strict=True):
            start, end = result.start, result.state
            hit = np.linalg.norm(end["velocity"] - start["velocity"]) > 1e-9
            hits += hit
            before, after = moving({**start}), moving(end)
            assert after == pytest.approx(before, rel=2e-4) if not law or not hit else after < before
    assert hits > len(shots) / 3


@pytest.mark.slow
def test_a_sphere_rolls_over_seams_as_on_a_plane():
    """Over seams and vertices of a sheet of triangles: at constant speed, and with the same motion as on a
    plane."""
    sunk = (3 * 10 / (4 * E_STAR * RADIUS**0.5)) ** (2 / 3)
    lever = RADIUS - sunk / 2
    law, gravity = {"friction": 0.5, "restitution": 0.5}, (0.0, 0.0, -10.0)
    more = {"law": law, "gravity": gravity, "steps": 40_000}
    ends = []
    for height, shapes in ((SHEET, {}), (0.0, {"planes": (geometry.Plane(),)})):
        start = (-1.5, 0.03, height + RADIUS - sunk)
        ends.append(beside(start, (3.0, 0.0, 0.0), shapes, spin=(0.0, 3 / lever, 0.0), **more))
        ends.append(beside(start, (2.0, 0.7, 0.0), shapes, **more))
    rolls, slides, rolled, slid = run(ends)
    assert rolls.state["velocity"][0, 0] == pytest.approx(3.0, abs=1e-7)
    for name in ("velocity", "spin"):
        np.testing.assert_allclose(rolls.state[name], rolled.state[name], rtol=0, atol=1e-7)
        np.testing.assert_allclose(slides.state[name], slid.state[name], rtol=0, atol=1e-7)
    np.testing.assert_allclose(rolls.state["position"][:, :2], rolled.state["position"][:, :2], atol=1e-8)
    # The sheet carries the weight everywhere.
    for result in (rolls, slides):
        assert result.measures["walls_force_z"] == pytest.approx(-10.0, rel=1e-6)


@pytest.mark.slow
def test_a_sphere_that_rolls_downhill_over_seams_keeps_its_grip():
    """On a tilted sheet: friction of 2/7 of the pull makes it roll. The tangential spring passes from
    triangle to triangle; otherwise the sphere would slip."""
    sunk = (3 * 10 / (4 * E_STAR * RADIUS**0.5)) ** (2 / 3)
    more = {"law": {"friction": 0.5, "restitution": 1.0}, "gravity": (2.0, 0.5, -10.0), "steps": 40_000}
    sheet, plane = run(
        [
            beside((-1.5, 0.03, height + RADIUS - sunk), (0.0, 0.0, 0.0), shapes, **more)
            for height, shapes in ((SHEET, {}), (0.0, {"planes": (geometry.Plane(),)}))
        ]
    )
    assert sheet.state["position"][0, 0] > -1.5 + 0.9 * 5 / 7 * sheet.time**2
    for name in ("velocity", "spin"):
        np.testing.assert_allclose(sheet.state[name], plane.state[name], rtol=0, atol=1e-6)
    slip = plane.state["velocity"] - np.cross(plane.state["spin"], [0, 0, RADIUS - sunk / 2])
    assert np.abs(slip[0, :2]).max() < 0.01


@pytest.mark.slow
def test_a_grain_on_a_seam_has_one_contact():
    """Exactly over a vertex, in which up to six triangles meet, and over an edge."""
    sunk = (3 * 10 / (4 * E_STAR * RADIUS**0.5)) ** (2 / 3)
    corners = [(2.0, 2.0), (0.0, 2.0), (-2.0, 0.5)]
    places = [(x, y, SHEET + RADIUS - sunk) for x, y in corners]
    scenes = [beside(place, (0, 0, 0), {}, gravity=(0, 0, -10), law=SOFT, steps=2000) for place in places]
    for place, result in zip(places, run(scenes), strict=True):
        np.testing.assert_allclose(result.state["position"][0], place, rtol=0, atol=1e-9)


@pytest.mark.slow
def test_faces_of_a_box_are_planes():
    """In a corner with all three of them, sliding and spinning: as with planes, including the contact
    history."""
    planes = tuple(geometry.Plane(point=(0, 0, 0), normal=tuple(axis)) for axis in np.eye(3))
    law = {"friction": 0.4, "restitution": 0.3}
    more = {"law": law, "gravity": (-3.0, -2.0, -9.0), "steps": 60_000, "spin": (30.0, -20.0, 10.0)}
    shapes = ({"planes": planes}, {"boxes": (geometry.BoxSurface(high=(2, 2, 2)),)})
    flat, box = run([beside((0.11, 0.12, 0.13), (0.5, -1.0, -1.0), one, **more) for one in shapes])
    for name in ("position", "velocity", "spin"):
        np.testing.assert_allclose(box.state[name], flat.state[name], rtol=0, atol=1e-9)
    for axis, pull in zip("xyz", (-3.0, -2.0, -9.0), strict=True):
        assert box.measures[f"walls_force_{axis}"] == pytest.approx(pull, rel=1e-3)
    assert box.state["walls_touched"][0] == 3


@pytest.mark.slow
def test_a_grain_lies_in_a_groove():
    """Each side of a groove of 90 degrees carries 1 / sqrt 2 of the weight; a sharp ridge carries
    all of it."""
    half, whole = ((3 * push / (4 * E_STAR * RADIUS**0.5)) ** (2 / 3) for push in (10 / 2**0.5, 10))
    sides = tuple(geometry.Disc(centre=(x, 0, 1), normal=(-x, 0, 1), radius=2**0.5) for x in (-1, 1))
    places = [(0, 0.2, 2**0.5 * (RADIUS - half)), (0.3, 4, SHEET + 1 + RADIUS - whole)]
    more = {"gravity": (0, 0, -10), "law": SOFT, "steps": 500}
    scenes = [
        beside(place, (0, 0, 0), shapes, **more)
        for place, shapes in zip(places, ({"discs": sides}, {}), strict=True)
    ]
    for place, touched, result in zip(places, (2, 1), run(scenes), strict=True):
        assert result.state["walls_touched"][0] == touched
        np.testing.assert_allclose(result.state["position"][0], place, rtol=0, atol=1e-9)
        assert result.measures["walls_force_z"] == pytest.approx(-10, rel=1e-6)
        # The torque about the origin.
        assert result.measures["walls_torque_x"] == pytest.approx(-10 * place[1], rel=1e-6)
