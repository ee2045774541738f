"""Walls at periodic faces of a box: accepted if they continue from face to face, refused if they would have
to act through a face."""

import numpy as np
import pytest

import tisim
from tisim.effects import Granular, Oscillation, Rotation, Servo, Translation, Walls
from tisim.geometry import (
    BoxSurface,
    ConicalSurface,
    CylindricalSurface,
    Disc,
    Plane,
    SphericalSurface,
    TriangulatedSurface,
)
from tisim.steppers import FixedStep, Verlet

SIDE, RADIUS, OVERLAP = 0.1, 5e-3, 1e-4
BOX = tisim.Box(low=(0, 0, 0), high=(SIDE,) * 3, periodic=(True, True, False))


def quad(*corners):
    """Return a flat surface of two triangles."""
    return TriangulatedSurface(vertices=corners, faces=[(0, 1, 2), (0, 2, 3)])


FLOOR = quad((0, 0, 0.02), (SIDE, 0, 0.02), (SIDE, SIDE, 0.02), (0, SIDE, 0.02))
STAIR = TriangulatedSurface(
    vertices=[
        *((x, y, z) for x, z in ((0, 0.01), (0, 0.03), (SIDE, 0.03), (SIDE, 0.01)) for y in (0, SIDE)),
    ],
    faces=[(0, 1, 3), (0, 3, 2), (2, 3, 5), (2, 5, 4)],
)
REFUSED = {
    "a sphere across a face": {"spheres": [SphericalSurface(centre=(0.001, 0.05, 0.05), radius=0.01)]},
    "a sphere within reach": {"spheres": [SphericalSurface(centre=(0.0149, 0.05, 0.05), radius=0.01)]},
    "a wall of triangles": {
        "surface": quad((0.002, 0, 0), (0.002, SIDE, 0), (0.002, SIDE, SIDE), (0.002, 0, SIDE))
    },
    "a floor that ends before the face": {
        "surface": quad((0, 0, 0.02), (0.098, 0, 0.02), (0.098, SIDE, 0.02), (0, SIDE, 0.02))
    },
    "a stair with its riser in the face": {"surface": STAIR},
    "a plane that leans": {"planes": [Plane(point=(0, 0, 0), normal=(0.1, 0, 1))]},
    "a plane across": {"planes": [Plane(point=(0, 0, 0), normal=(0, 1, 0))]},
    "a post": {
        "cylinders": [CylindricalSurface(start=(0.002, 0.05, 0), end=(0.002, 0.05, SIDE), radius=0.01)]
    },
    "a duct of pieces of two radii": {
        "cylinders": [
            CylindricalSurface(start=(-0.02, 0.05, 0.06), end=(0.03, 0.05, 0.06), radius=0.04),
            CylindricalSurface(start=(0.03, 0.05, 0.06), end=(SIDE + 0.02, 0.05, 0.06), radius=0.041),
        ]
    },
    "a duct that ends at a face": {
        "cylinders": [
            CylindricalSurface(start=(-0.02, 0.05, 0.06), end=(0.03, 0.05, 0.06), radius=0.04),
            CylindricalSurface(start=(0.03, 0.05, 0.06), end=(SIDE - 0.001, 0.05, 0.06), radius=0.04),
        ]
    },
    "a cone": {
        "cones": [
            ConicalSurface(
                start=(0.05, 0.09, 0.02), end=(0.05, 0.09, 0.08), start_radius=0.001, end_radius=0.02
            )
        ]
    },
    "a disc": {"discs": [Disc(centre=(0.05, 0.003, 0.05), normal=(1, 0, 0), radius=0.01)]},
    "a box": {"boxes": [BoxSurface(low=(0.09, 0.04, 0.04), high=(0.098, 0.06, 0.06))]},
}  # fmt: skip
FELT = {
    "a floor of triangles": {"surface": FLOOR},
    "a plane": {"planes": [Plane(point=(0, 0, 0.02))]},
    "a sphere farther than a radius": {
        "spheres": [SphericalSurface(centre=(0.0151, 0.05, 0.05), radius=0.01)],
        "planes": [Plane(point=(0, 0, 0.02))],
    },
    "a cylinder from face to face": {
        "cylinders": [CylindricalSurface(start=(0, 0.05, 0.06), end=(SIDE, 0.05, 0.06), radius=0.04)]
    },
    "a duct of two pieces that reach beyond": {
        "cylinders": [
            CylindricalSurface(start=(-0.02, 0.05, 0.06), end=(0.03, 0.05, 0.06), radius=0.04),
            CylindricalSurface(start=(0.03, 0.05, 0.06), end=(SIDE + 0.02, 0.05, 0.06), radius=0.04),
        ]
    },
    "a box wider than the other": {"boxes": [BoxSurface(low=(0, 0, 0.02), high=(SIDE, SIDE, 0.09))]},
}


def scene(duration=1e-6, **walls):
    """Return a grain that overlaps a floor at 0.02 m by OVERLAP, in the middle."""
    return tisim.Scene(
        particles=tisim.Particles(
            position=[(0.05, 0.05, 0.02 + RADIUS - OVERLAP)], velocity=[(0, 0, 0)], radius=RADIUS,
            density=2500.0,
        ),
        materials={"glass": tisim.Material(young=1e7, poisson=0.25)},
        effects=(Granular(), Walls(**walls)),
        domain=BOX,
        stepper=Verlet(control=FixedStep(dt=1e-6)),
        duration=duration,
    )  # fmt: skip


def start(made):
    """Check the start of a scene as a run does, without compiling it."""
    for effect in made.acting():
        effect.check_start(made.start(), made)


def test_a_mesh_without_distances_is_refused_beside_a_duct(monkeypatch):
    """A mesh of very many triangles is not accepted as equal at both faces."""
    monkeypatch.setattr("tisim.geometry.triangles.MOST_DISTANCES", 1)
    both = FELT["a duct of two pieces that reach beyond"] | {"surface": STAIR}
    with pytest.raises(tisim.InputError, match="it does not act through them"):
        start(scene(**both))


@pytest.mark.parametrize("radius", [1e-5, 1e-4])
def test_a_duct_of_pieces_is_accepted_for_small_grains(radius):
    made = scene(**FELT["a duct of two pieces that reach beyond"])
    start(made.replace({"particles.radius": radius}))


@pytest.mark.long
def test_a_run_checks_its_walls():
    with pytest.raises(tisim.InputError, match="it does not act through them"):
        tisim.run(scene(**REFUSED["a plane across"]))


@pytest.mark.parametrize("name", REFUSED)
def test_walls_that_act_through_a_face_are_refused(name):
    with pytest.raises(
        tisim.InputError, match=r"^walls\.\w+ must be farther than the largest radius, 0.005 m"
    ):
        start(scene(**REFUSED[name]))


@pytest.mark.parametrize("name", REFUSED)
def test_without_periodic_faces_walls_are_accepted(name):
    open_box = tisim.Box(low=(0, 0, 0), high=(SIDE,) * 3, periodic=(False, False, False))
    changed = scene(**REFUSED[name]).model_copy(update={"domain": open_box})
    start(changed)


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["a plane", *(pytest.param(name, marks=pytest.mark.slow) for name in FELT if name != "a plane")]
)
def test_walls_that_continue_across_faces_act(name):
    (result,) = tisim.run([scene(**FELT[name])])
    force = 4 / 3 * 1e7 / (2 * (1 - 0.25**2)) * np.sqrt(RADIUS) * OVERLAP**1.5
    assert result.measures["walls_force_z"] == pytest.approx(-force, rel=1e-3)


BALL = {"spheres": [SphericalSurface(centre=(0.05, 0.05, 0.05), radius=0.01)]}
PADDLE = {"surface": quad((0.03, 0.05, 0.03), (0.07, 0.05, 0.03), (0.07, 0.05, 0.07), (0.03, 0.05, 0.07))}
BELT = {"surface": TriangulatedSurface(
    vertices=[(x, y, z) for x, z in ((-2, 0.02), (-0.21, 0.02), (-0.2, 0.03), (-0.19, 0.02), (2, 0.02))
              for y in (0, SIDE)],
    faces=[face for k in range(0, 8, 2) for face in ((k, k + 1, k + 3), (k, k + 3, k + 2))],
)}  # fmt: skip
MIDDLE, ABOUT_Z, ABOUT_Y = (0.05, 0.05, 0.05), (0, 0, 1.0), (0, 1.0, 0)
DRUM = {"cylinders": [CylindricalSurface(start=(0, 0.05, 0.05), end=(SIDE, 0.05, 0.05), radius=0.03)]}
MOVED = {
    "a ball that comes to a face": (BALL, Translation(velocity=(1.0, 0, 0)), 0.0351, False),
    "a ball that stops before": (BALL, Translation(velocity=(1.0, 0, 0)), 0.0349, True),
    "a ball that starts late": (BALL, Translation(velocity=(1.0, 0, 0), begin=0.01), 0.044, True),
    "a ball along what is not periodic": (BALL, Translation(velocity=(0, 0, 1.0)), 1.0, True),
    "a ball that swings far": (BALL, Oscillation(amplitude=(0, 0.0351, 0), frequency=1.0), 1.0, False),
    "a ball that swings": (BALL, Oscillation(amplitude=(0, 0.0349, 0), frequency=1.0), 1.0, True),
    "a ball on a servo": (BALL, Servo(force=1.0, direction=(1, 0, 0), limit=0.1), 0.351, False),
    "a ball on a slow servo": (BALL, Servo(force=1.0, direction=(1, 0, 0), limit=0.1), 0.349, True),
    "a ball that goes round": (BALL, Rotation(rate=ABOUT_Z, centre=(0.03, 0.05, 0)), 1.0, False),
    "a ball about itself": (BALL, Rotation(rate=ABOUT_Z, centre=MIDDLE), 1.0, True),
    "a paddle": (PADDLE, Rotation(rate=ABOUT_Z, centre=MIDDLE), 1.0, True),
    "a paddle off its middle": (PADDLE, Rotation(rate=ABOUT_Z, centre=(0.03, 0.05, 0)), 1.0, False),
    "a turntable": ({"planes": [Plane(point=(0, 0, 0.02))]}, Rotation(rate=ABOUT_Z), 1.0, True),
    "a floor that tilts": ({"planes": [Plane(point=(0, 0, 0.02))]}, Rotation(rate=ABOUT_Y), 1.0, False),
    "a drum": (DRUM, Rotation(rate=(1.0, 0, 0), centre=MIDDLE), 1.0, True),
    "a drum that turns over": (DRUM, Rotation(rate=ABOUT_Z, centre=MIDDLE), 1.0, False),
    "a floor that is lifted": ({"surface": FLOOR}, Translation(velocity=(0, 0, 0.01)), 1.0, True),
    "a belt with a bump that passes both faces": (BELT, Translation(velocity=(1.0, 0, 0)), 0.5, False),
    "a duct of two pieces of which the joint passes": (
        {"cylinders": [
            CylindricalSurface(start=(-2, 0.05, 0.06), end=(-0.2, 0.05, 0.06), radius=0.02),
            CylindricalSurface(start=(-0.2, 0.05, 0.06), end=(2, 0.05, 0.06), radius=0.04),
        ]},
        Translation(velocity=(1.0, 0, 0)), 0.5, False,
    ),
    "a floor that is drawn away": ({"surface": FLOOR}, Translation(velocity=(0.01, 0, 0)), 1.0, False),
}  # fmt: skip


@pytest.mark.parametrize("name", MOVED)
def test_walls_that_move_to_a_face_are_refused(name):
    walls, motion, duration, taken = MOVED[name]
    made = scene(**walls, motion=motion, duration=duration)
    if taken:
        start(made)
    else:
        with pytest.raises(tisim.InputError, match="received one that ends or bends there"):
            start(made)


SHAPES = [
    one
    for walls in REFUSED.values()
    for shapes in walls.values()
    for one in (shapes if isinstance(shapes, list) else [shapes])
    if not isinstance(one, Plane)
]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.kind())
def test_extents_of_shapes_are_tight(shape):
    """No farther, and not less: its distance from points outside its extent is positive, and close to 0
    somewhere on its boundary."""
    low, high = shape.extent()
    draw = np.random.default_rng(1)
    for axis in range(3):
        for face in (low, high):
            places = draw.uniform(low - 1e-9, high + 1e-9, (4000, 3))
            places[:, axis] = face[axis]
            beyond = places.copy()
            beyond[:, axis] += 1e-3 if face is high else -1e-3
            assert np.abs(shape.distances(beyond)).min() > 1e-3 * (1 - 1e-9)
            assert np.abs(shape.distances(places)).min() < 2e-3
