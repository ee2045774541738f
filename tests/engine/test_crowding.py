"""Starts with deep overlaps between grains: refused, or accepted with a warning."""

import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.scenes import compiled, fixed, scene
from tisim import Box, Cloud, GrainClass, InputError, Material, RandomInBall, RandomInBox, Scene, StartWarning
from tisim.backend import memory
from tisim.effects import Gravity, Hertz, Impact, Oscillation, PrescribedMotion, Walls
from tisim.engine.crowding import check_places, warn_of_overlaps
from tisim.geometry import (
    BoxSurface,
    ConicalSurface,
    CylindricalSurface,
    Disc,
    Plane,
    SphericalSurface,
    TriangulatedSurface,
)
from tisim.packing import EqualSizes

R = 1e-3
MATERIALS = {"grain": Material(young=1e7, poisson=0.3, restitution=0.5, friction=0.5)}


def start(position, *others, radius=R, **more):
    """Grains at rest under a granular law, which keeps them apart."""
    position = np.asarray(position, float)
    return scene(
        position, np.zeros_like(position), (HERTZ_MINDLIN, *others), radius, materials=MATERIALS, **more
    )


def found(*scenes):
    """The warning for some scenes; empty if there is none."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        warn_of_overlaps([check_places(one, one.start()) for one in scenes])
    assert all(one.category is StartWarning for one in told)
    assert len(told) < 2
    return str(told[0].message) if told else ""


def refused(one):
    """The error message for a start."""
    with pytest.raises(InputError) as fault:
        check_places(one, one.start())
    return str(fault.value)


def test_grains_at_one_place_are_refused_by_name():
    """For any number of particles, in short time and little memory."""
    rule = (
        "particles.position must be a different place for each particle, as effects.granular holds them apart"
    )
    one = start([[1, 0, 0], [0, 0, 0], [2, 0, 0], [0, 0, 0]])
    assert refused(one) == f"{rule}; received particles 1 and 3 both at (0, 0, 0) m"
    began = time.perf_counter()
    assert refused(start(np.zeros((100_000, 3)))).endswith("and 100000 particles in all share places")
    assert time.perf_counter() - began < 20


def test_without_repulsion_particles_may_coincide():
    """Members of one body are not kept apart either."""
    assert check_places(*alone(scene([[0, 0, 0]] * 3, [[0, 0, 0]] * 3, (Gravity(),)))) == []
    plate = PrescribedMotion(group=1)
    together = start([[0, 0, 0]] * 2, plate, quantities={"group": [1.0, 1.0]})
    assert check_places(*alone(together)) == []
    assert "particles 0 and 1" in refused(start([[0, 0, 0]] * 2, plate, quantities={"group": [1.0, 0.0]}))


def test_a_skin_with_thousands_of_neighbours_is_refused(rng):
    """Lists of 2e8 pairs prevented a run from starting. A few particles may all be listed."""
    places = rng.uniform(0, 0.1, (20_000, 3))
    with pytest.raises(
        InputError, match=r"scene.skin must be so small .*; received 1000 m, within which each "
    ):
        check_places(*alone(start(places, radius=1e-5, skin=1e3)))
    check_places(*alone(start(places, radius=1e-5, skin=0.01)))
    check_places(*alone(start(places[:1000], radius=1e-5, skin=1e3)))
    # This scene has no lists.
    check_places(*alone(scene(places, 0 * places, (Gravity(),), 1e-5, skin=1e3)))


def alone(one):
    """A scene and its start."""
    return one, one.start()


@pytest.mark.parametrize("number", [1000, 10_000, 100_000])
def test_a_crowd_is_refused_before_lists_are_made(number):
    """In a box of ten radii; the message counts the grains that one grain overlaps."""
    side, radius = 1e-3, 1e-4
    place = np.random.default_rng(0).uniform(0, side, (number, 3))
    made = start(place, radius=radius, domain=Box(low=(0, 0, 0), high=(side,) * 3))
    words = refused(made)
    assert "each overlaps at most the 16 others that effects.granular has room for" in words
    who, count = int(words.split("particle ")[1].split()[0]), int(words.split()[-2])
    apart = place - place[who]
    apart -= side * np.rint(apart / side)
    assert count == ((apart**2).sum(axis=1) < (2 * radius) ** 2).sum() - 1


def test_hard_spheres_in_a_crowd_are_refused():
    """At most eight pairs per grain can be in contact."""
    place = np.random.default_rng(0).uniform(0, 1e-3, (3000, 3))
    crowd = scene(place, np.zeros((3000, 3)), (Impact(hardness=1e5),), 1e-4)
    assert "at most 8 pairs overlap for each of them; received about" in refused(crowd)


def test_deep_overlaps_give_a_warning():
    """Overlaps of half of the smaller radius, in open space and across a periodic face, between equal and
    unlike grains; one warning for all scenes states their number."""
    assert found(start([[0, 0, 0], [1.51 * R, 0, 0]])) == ""
    words = (
        "particles 0 and 1 overlap by 0.000505 m, 0.505 of the smaller radius, at (0, 0, 0) m, at the start"
    )
    assert found(start([[0, 0, 0], [1.495 * R, 0, 0]])) == words
    box = Box(low=(0, 0, 0), high=(10 * R,) * 3)
    across = start([[0.2 * R, 5 * R, 5 * R], [9 * R, 5 * R, 5 * R]], domain=box)
    assert "particles 0 and 1 overlap by 0.0008 m" in found(across)
    open_faces = start([[0.2 * R, 5 * R, 5 * R], [9 * R, 5 * R, 5 * R]], domain=box.model_copy(
        update={"periodic": (False, False, False)}))  # fmt: skip
    assert found(open_faces) == ""
    unlike = start([[0, 0, 0], [1.004 * R, 0, 0], [-1.006 * R, 0, 0]], radius=[R, 0.01 * R, 0.01 * R])
    assert "particles 0 and 1 overlap by 6e-06 m, 0.6 of the smaller radius" in found(unlike)
    three = found(
        start([[0, 0, 0], [1.4 * R, 0, 0], [0, 1.3 * R, 0]]),
        start([[0, 0, 0], [R, 0, 0]]),
        start([[0, 0, 0]]),
    )
    assert three.startswith("particles 0 and 1 overlap by 0.001 m, 1 of")
    assert three.endswith("; 2 more overlap by 0.5 of a radius or more, in 2 of 3 scenes")


SHEETS = {
    "discs": Disc(centre=(0, 0, 0), radius=1.0),
    "spheres": SphericalSurface(centre=(0, 0, 1.0), radius=1.0),
    "cylinders": CylindricalSurface(start=(-1, 0, 1), end=(1, 0, 1), radius=1.0),
    "cones": ConicalSurface(start=(0, 0, 0), end=(0, 0, 1), start_radius=0.5, end_radius=1.0, closed=True),
    "boxes": BoxSurface(low=(-1, -1, 0), high=(1, 1, 1)),
}
TRIANGLES = TriangulatedSurface(
    vertices=[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], faces=[(0, 1, 2), (0, 2, 3)]
)


@pytest.mark.parametrize("kind", [*SHEETS, "triangles"])
@pytest.mark.parametrize("side", [1, -1])
def test_grains_in_a_sheet_give_a_warning(kind, side):
    """From either side of the sheet."""
    wall = Walls(surface=TRIANGLES) if kind == "triangles" else Walls(**{kind: (SHEETS[kind],)})
    assert found(start([[0, 1e-2, side * 0.9 * R + bend(kind)]], wall)) == ""
    words = found(start([[0, 1e-2, side * 0.4 * R + bend(kind)]], wall))
    assert words.startswith("particle 0 lies in effects.walls by 0.0006 m, 0.6 of its radius, at ")


def bend(kind):
    """The height (m) of a curved sheet above z = 0 at y = 1 cm."""
    return 1 - np.sqrt(1 - 1e-4) if kind in ("spheres", "cylinders") else 0.0


def test_grains_behind_a_plane_give_a_warning():
    """Also behind a moving wall, at its initial position."""
    floor = Walls(planes=(Plane(),))
    assert found(start([[0, 0, R], [1, 0, 0.51 * R]], floor)) == ""
    words = (
        "particle 1 lies behind effects.walls by 0.006 m, 6 of its radius, at (1, 0, -0.005) m, at the start"
    )
    assert found(start([[0, 0, R], [1, 0, -5 * R]], floor)) == words
    up = Oscillation(amplitude=(0, 0, 2 * R), frequency=50.0, phase=np.pi / 2)
    assert found(start([[0, 0, R]], Walls(planes=(Plane(),), motion=up))).startswith("particle 0 lies behind")


@pytest.mark.parametrize(
    "placement",
    [RandomInBall(centre=(0, 0, 0), radius=0.02), RandomInBox(low=(-0.02,) * 3, high=(0.02,) * 3)],
)
def test_packings_of_the_package_do_not_overlap(placement):
    """Also with unlike sizes."""
    classes = tuple(GrainClass(sizes=EqualSizes(radius=r), density=2e3) for r in (R, 0.1 * R))
    for grains in (classes, classes[:1]):
        cloud = Cloud(number=300, grains=grains, placement=placement)
        one = Scene(
            particles=cloud, effects=(HERTZ_MINDLIN,), materials=MATERIALS, duration=1.0, stepper=fixed(1e-3)
        )
        assert check_places(one, one.start()) == []


def test_lists_beyond_memory_are_refused_in_advance(monkeypatch):
    """At the start, an error states the position and the number of grains there; in a run, the world fails
    and others continue."""

    def thrown(speed):
        place = np.random.default_rng(1).uniform(-1, 1, (64, 3))
        place *= 50 * R / np.linalg.norm(place, axis=1)[:, None] * np.linspace(0.5, 1, 64)[:, None]
        # Each grain is at the middle after this number of steps.
        return scene(place, -speed * place, (Hertz(young=1e-9, poisson=0.3),), R, dt=1e-4, steps=120)

    made = [thrown(100.0 * part) for part in (1.0, 0.0)]
    simulation = compiled(made[0], 2, 64)
    monkeypatch.setattr(memory, "LISTS_PART", 0.0)
    simulation.load(made)
    simulation.run()
    crowded, still = simulation.results()
    assert still.status.ok
    assert not crowded.status.ok
    assert "more near pairs than their list has room for, at particle" in crowded.status.reason
    assert "must be within the 0 GB that are left for lists of pairs" in crowded.status.reason
    middle = made[0].start()["position"] * 1e-2
    with (
        pytest.warns(StartWarning),
        pytest.raises(InputError, match=r"particle \d+ at \(.*\) m, one of those"),
    ):
        simulation.load([scene(middle, 0 * middle, made[0].effects, R, dt=1e-4, steps=120)])


@pytest.mark.slow
def test_a_command_prints_the_warning_on_one_line(tmp_path):
    """On standard error, for any place in the code."""
    two = scene([[0, 0, 0], [R, 0, 0]], np.zeros((2, 3)), (Hertz(young=1e-9, poisson=0.3),), R)
    (tmp_path / "two.toml").write_text(two.to_toml())
    command = [sys.executable, "-m", "tisim", "run", "two.toml", "--out", "out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    lines = [line for line in done.stderr.splitlines() if "overlap" in line]
    assert lines == [
        "warning: particles 0 and 1 overlap by 0.001 m, 1 of the smaller radius, at (0, 0, 0) m, at the start"
    ]
