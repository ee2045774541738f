"""Packings in containers: attempts against a NumPy reference, scaling, closed forms, bits, and refusals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.compare import same_arrays
from tests.steppers.packing.test_mechanical_contraction import ROD, SPHERE, attempt, rod_contact
from tisim import Box, InputError, Particles, Scene, Simulation, run
from tisim.effects import Confinement, HardRods
from tisim.engine.checkpoint import restore, save
from tisim.geometry import BoxContainer, CylindricalContainer, SphericalContainer, WedgeContainer
from tisim.packing import random_bodies, wall_gaps
from tisim.shapes import SpherocylinderShape
from tisim.steppers import FixedStep, MechanicalContraction, Verlet

CYLINDER, SPHERICAL = CylindricalContainer(diameter=4.0), SphericalContainer()
WEDGE = WedgeContainer(length=7.0, angle=np.radians(35))
SLIT = BoxContainer(hard=(True, False, True), width=(3.0, 0.0, 0.0))
CONTAINERS = (CYLINDER, WEDGE, SLIT, SPHERICAL)
TREATMENTS = ("exact", "virtual")
TOLERANCE = 1e-4
every_container = pytest.mark.parametrize("container", CONTAINERS, ids=lambda one: one.kind())
every_treatment = pytest.mark.parametrize("treatment", TREATMENTS)


def scene(container, shape=ROD, number=80, fraction=0.15, seed=0, treatment="exact", margin=None, **settings):
    """Bodies at random inside a container; with a margin, their centres alone, that far away from walls."""
    start = random_bodies(shape, number, fraction, container, seed)
    given = start.particles()
    if margin is not None:
        numbers = np.random.default_rng(seed).uniform(size=(number, 3))
        given["position"] = container.points(numbers, np.array(start.box.high), shape.diameter, margin)
    return Scene(
        particles=Particles(**given),
        effects=[HardRods(rods=(shape,)), Confinement(container=container, treatment=treatment)],
        domain=start.box,
        duration=settings.pop("duration", 1e6),
        stepper=MechanicalContraction(**settings),
        seed=seed,
    )


def faces(container, side):
    """Of each wall: a function from a point to its distance and the normal away from the container, and the
    direction of virtual rods, as B16 describes them in 2.2.4. D is 1."""
    x, y, z = np.eye(3)
    if isinstance(container, CylindricalContainer):

        def lateral(p):
            rho = np.array([p[0] - side[0] / 2, p[1] - side[1] / 2, 0])
            return container.diameter / 2 - np.linalg.norm(rho), rho / np.linalg.norm(rho)

        return [(lateral, lambda n: z)]
    if isinstance(container, SphericalContainer):

        def surface(p):
            away = p - side / 2
            return side[0] / 2 - np.linalg.norm(away), away / np.linalg.norm(away)

        def tangent(n):
            t = np.cross(n, np.eye(3)[np.abs(n).argmin()])
            return t / np.linalg.norm(t)

        return [(surface, tangent)]
    if isinstance(container, WedgeContainer):
        c, s = np.cos(container.angle), np.sin(container.angle)
        return [
            (lambda p: (p[1], -y), lambda n: x),
            (lambda p: (p[0] * s - p[1] * c, np.array([-s, c, 0])), lambda n: np.array([c, s, 0])),
            (lambda p: (container.length - p[0], x), lambda n: y),
        ]
    wide = container.width[0]
    return [
        (lambda p: (p[0] - side[0] / 2 + wide / 2, -x), lambda n: y),
        (lambda p: (side[0] / 2 + wide / 2 - p[0], x), lambda n: y),
        (lambda p: (p[2], -z), lambda n: x),
        (lambda p: (side[2] - p[2], z), lambda n: x),
    ]


def reference_walls(container, side, shape, treatment, seen):
    """The overlaps of a rod with walls, for ``attempt``: each end alone, as a sphere of radius R."""
    walls, half, radius = faces(container, side), shape.length / 2, shape.diameter / 2

    def overlaps(place, axis):
        found = []
        for sign in (1, -1) if half else (1,):
            end = sign * half * axis
            for distance, direction in walls:
                gap, outward = distance(place + end)
                depth, normal, here = radius - gap, outward, end + radius * outward
                if treatment == "virtual" and 0 < depth < radius:
                    # B16: at the distance R beyond the wall.
                    beyond = end + (gap + radius) * outward
                    depth, normal, here, _ = rod_contact(beyond, axis, direction(outward), half, radius)
                    seen.append(depth - (radius - gap))
                found.append((depth, -normal, here))
        return found

    return overlaps


@every_container
@every_treatment
def test_an_attempt_equals_its_reference(container, treatment):
    """Many ends protrude, by up to their whole length. Both methods of contraction are taken in turn."""
    method = "revised" if treatment == "exact" else "original"
    made = scene(container, treatment=treatment, margin=0.0, method=method)
    side, seen = np.array(made.domain.high), []
    walls = reference_walls(container, side, ROD, treatment, seen)
    periodic = [not hard for hard in container.walled()]
    simulation = Simulation(made, 1)
    simulation.load([made])
    for _ in range(4):
        before = {name: np.array(simulation.state[name]) for name in ("position", "orientation")}
        places, orientations = attempt(before, side, ROD, method, periodic=periodic, walls=walls)
        simulation.run(steps=1)
        after = {name: np.array(simulation.state[name]) for name in before}
        np.testing.assert_allclose(after["position"], places, rtol=0, atol=1e-10)
        found = Rotation.from_quat(after["orientation"], scalar_first=True).as_matrix()
        np.testing.assert_allclose(found[:, :, 2], orientations[:, :, 2], rtol=0, atol=1e-10)
    if treatment == "virtual":
        # A virtual rod is never less deep than the end that protrudes, up to rounding.
        assert len(seen) > 20
        assert min(seen) > -1e-9
    simulation.close()


def gaps(result):
    """The least gap between bodies and walls, in D."""
    (rod,), container = result.scene.effects[0].rods, result.scene.effects[1].container
    size = float(result.state["radius"][0]) / rod.bounding_radius()
    state, side = result.state, np.array(result.scene.domain.high)
    return wall_gaps(rod, state["position"], state["orientation"], container, side, size).min() / size


def deepest(result):
    """The deepest overlap between bodies, in D."""
    (rod,) = result.scene.effects[0].rods
    size = float(result.state["radius"][0]) / rod.bounding_radius()
    x, side = result.state["position"], np.array(result.scene.domain.high)
    axes = Rotation.from_quat(result.state["orientation"], scalar_first=True).apply([0.0, 0.0, 1.0])
    depths = []
    for i in range(len(x)):
        d = x[:i] - x[i]
        d -= np.where(result.scene.domain.periodic, side * np.round(d / side), 0)
        for j in np.flatnonzero(np.linalg.norm(d, axis=1) < 2 * result.state["radius"][0]):
            half, radius = size * rod.length / 2, size * rod.diameter / 2
            depths.append(rod_contact(d[j], axes[i], axes[j], half, radius)[0] / (2 * radius))
    return max(depths)


def fraction(result):
    (rod,), container = result.scene.effects[0].rods, result.scene.effects[1].container
    size = float(result.state["radius"][0]) / rod.bounding_radius()
    side = np.array(result.scene.domain.high)
    volume = container.volume_in(side, size * rod.diameter)
    return len(result.state["radius"]) * rod.volume() * size**3 / volume


@every_container
@every_treatment
def test_a_packing_has_no_overlaps_with_bodies_or_walls(container, treatment):
    shape = ROD if treatment == "exact" else SPHERE
    made = scene(
        container, shape, treatment=treatment, method="original", attempts=200, volume_step=4.0, halvings=2
    )
    result = run(made)
    assert result.status.ok
    assert result.time < made.duration
    assert 0.3 < fraction(result) < 0.7
    assert -gaps(result) <= TOLERANCE * (1 + 1e-9)
    assert deepest(result) <= TOLERANCE * (1 + 1e-9)
    # Some bodies touch walls.
    assert gaps(result) < 0.01


def test_both_treatments_move_spheres_alike():
    """For spheres the overlaps are equal up to rounding, unless they protrude by more than D/2."""
    states = []
    for treatment in TREATMENTS:
        made = scene(CYLINDER, SPHERE, treatment=treatment, margin=0.1, method="original")
        simulation = Simulation(made, 1)
        simulation.load([made])
        simulation.run(steps=20)
        states.append(simulation.state["position"])
        simulation.close()
    np.testing.assert_allclose(*states, rtol=0, atol=1e-9)


@pytest.mark.parametrize("container", [CYLINDER, SLIT], ids=lambda one: one.kind())
def test_a_container_grows_with_its_bodies(container):
    """In a contraction without overlaps bodies move away from the middle along the scaled axes alone, and the
    volume decreases by its step."""
    made = scene(container, SPHERE, 48, 0.02, method="original", volume_step=2.0)
    simulation = Simulation(made, 1)
    simulation.load([made])
    side, scaled = np.array(made.domain.high), np.array(container.scaled())
    contracted, checked = 3 - scaled.sum(), 0
    for _ in range(80):
        before = {name: np.array(simulation.state[name]) for name in ("position", "radius")}
        simulation.run(steps=1)
        after = {name: np.array(simulation.state[name]) for name in before}
        growth = after["radius"][0] / before["radius"][0]
        if growth > 1 and int(simulation.s.read("packing_action")[0]) == 1:
            volumes = [container.volume_in(side, 2 * one["radius"][0]) for one in (before, after)]
            ratio = volumes[1] / volumes[0] / growth**3
            assert ratio == pytest.approx(growth**-contracted, rel=1e-12)
            in_units = [
                v / (2 * one["radius"][0]) ** 3 for v, one in zip(volumes, (before, after), strict=True)
            ]
            assert in_units[0] - in_units[1] == pytest.approx(2.0, rel=1e-9)
            moved = side / 2 + np.where(scaled, growth, 1.0) * (before["position"] - side / 2)
            np.testing.assert_allclose(after["position"], moved, rtol=0, atol=1e-12)
            checked += 1
    assert checked > 3
    simulation.close()


def placed(shape, container, position, axes, box, **settings):
    """Bodies at given places and along given axes."""
    turns = Rotation.align_vectors
    orientation = [turns([axis], [[0.0, 0.0, 1.0]])[0].as_quat(scalar_first=True) for axis in axes]
    particles = Particles(
        position=position,
        velocity=np.zeros_like(position),
        mass=1.0,
        radius=shape.bounding_radius(),
        quantities={"orientation": np.array(orientation)},
    )
    periodic = tuple(not hard for hard in container.walled())
    return Scene(
        particles=particles,
        effects=[HardRods(rods=(shape,)), Confinement(container=container)],
        domain=Box(low=(0, 0, 0), high=tuple(box), periodic=periodic),
        duration=1e6,
        stepper=MechanicalContraction(method="original", volume_step=0.1, attempts=300, **settings),
    )


@pytest.mark.parametrize("length", [0.0, 2.0])
def test_a_single_file_in_the_narrowest_cylinder(length):
    """In a cylinder of the diameter D a row of rods ends at phi = (4/3 R + L)/(2 R + L), spheres at 2/3."""
    shape, number = SpherocylinderShape(length=length, diameter=1.0), 12
    container, spacing = CylindricalContainer(diameter=1.0), 1.2 * (length + 1)
    position = np.column_stack([np.full((number, 2), 0.5), spacing * (np.arange(number) + 0.5)])
    axes = np.tile([0.0, 0.0, 1.0], (number, 1))
    result = run(placed(shape, container, position, axes, (1, 1, number * spacing), halvings=12))
    closed = (2 / 3 + length) / (1 + length)
    # An overlap of the tolerance is permitted in every contact, and rods may be inclined by as much.
    assert closed - 2e-4 < fraction(result) < closed * (1 + 2e-4)


@pytest.mark.parametrize("degrees", [9.0, 45.0])
def test_a_single_row_in_the_smallest_wedge(degrees):
    """A row of rods along the slope touches all three walls (2.12), and ends at the packing fraction of
    (2.13)."""
    angle, length, number = np.radians(degrees), 2.0, 16
    shape = SpherocylinderShape(length=length, diameter=1.0)
    shortest = 0.5 / np.tan(angle / 2) + 0.5 + length * np.cos(angle)
    assert WedgeContainer.shortest(angle, length + 1) == pytest.approx(shortest, rel=1e-14)
    container = WedgeContainer(length=shortest, angle=angle)
    along, width = np.array([np.cos(angle), np.sin(angle), 0.0]), 1.02 * number
    lower = np.array([0.5 / np.tan(angle / 2), 0.5, 0.0])
    row = np.array([0.0, 0.0, 1.02]) * (np.arange(number)[:, None] + 0.5)
    box = np.array([shortest, shortest * np.tan(angle), width])
    turns = Rotation.align_vectors([along], [[0.0, 0.0, 1.0]])[0].as_quat(scalar_first=True)
    position = lower + length / 2 * along + row
    touching = wall_gaps(shape, position, np.tile(turns, (number, 1)), container, box)
    np.testing.assert_allclose(touching, 0.0, rtol=0, atol=1e-12)
    made = placed(shape, container, position, np.tile(along, (number, 1)), box, halvings=12)
    closed = np.pi / 4 * (2 / 3 + length) / (0.5 * shortest**2 * np.tan(angle))
    assert fraction(run(made)) == pytest.approx(closed, rel=3e-4)


def test_the_bits_do_not_depend_on_batch_portions_or_checkpoint(tmp_path):
    """In wedges of different lengths, whose bodies begin behind the walls in part."""
    scenes = [
        scene(
            WedgeContainer(length=7.0 + k, angle=0.5), number=80 + k, seed=k, duration=300.0, margin=0.3,
            method="original", treatment="virtual",
        )
        for k in range(3)
    ]  # fmt: skip
    usual = run(scenes)
    (alone,) = run([scenes[1]])
    simulation = Simulation(scenes[0], 3, capacity=82)
    simulation.load(scenes)
    simulation.run(steps=37)
    save(simulation, tmp_path / "c.h5")
    simulation.run(steps=3)
    simulation.load(scenes)
    restore(simulation, tmp_path / "c.h5")
    simulation.run()
    assert usual[1].work["contractions"] > 0
    for other in (alone, simulation.results()[1]):
        assert (other.time, other.work) == (usual[1].time, usual[1].work)
        same_arrays(other.state, usual[1].state)
    simulation.close()


def test_a_resumed_packing_returns_to_its_last_configuration(tmp_path):
    made = scene(CYLINDER, SPHERE, attempts=60, volume_step=8.0, method="original", halvings=1)
    simulation = Simulation(made, 1)
    simulation.load([made])
    while int(simulation.s.read("attempted")[0]) < 50 or not int(simulation.s.read("contractions")[0]):
        simulation.run(steps=1)
    save(simulation, tmp_path / "c.h5")
    simulation.run()
    (expected,) = simulation.results()
    simulation.load([made])
    restore(simulation, tmp_path / "c.h5")
    simulation.run()
    (resumed,) = simulation.results()
    assert resumed.time == expected.time
    same_arrays(resumed.state, expected.state)
    assert -gaps(resumed) <= TOLERANCE * (1 + 1e-9)
    simulation.close()


def test_what_does_not_fit_is_refused():
    made = scene(CYLINDER)
    parts = {name: getattr(made, name) for name in ("particles", "effects", "domain", "duration", "stepper")}
    bodies, around = made.effects
    high = made.domain.high
    inside = [bodies, Confinement(container=SphericalContainer())]
    periodic, closed = Box(low=(0, 0, 0), high=high), Box(low=(0, 0, 0), high=high, periodic=(False,) * 3)
    for change, message in (
        (
            {"domain": periodic},
            "domain must be a box that is periodic along z alone for cylindrical_container",
        ),
        ({"domain": closed, "effects": inside}, "domain must be a cube around a spherical_container"),
        (
            {"effects": [bodies, around, around.model_copy(update={"name": "other"})]},
            "effects of kind confinement must be at most one in a scene; received 2",
        ),
        ({"effects": [around]}, "effects must be one with hard bodies for mechanical_contraction"),
        ({"stepper": Verlet(control=FixedStep(dt=1.0))}, "stepper must be one that packs"),
    ):
        with pytest.raises(InputError, match=message):
            Scene(**{**parts, **change})
    longer = made.start() | {"radius": np.linspace(1.0, 1.1, 80)}
    with pytest.raises(InputError, match=r"particles.radius must be in one ratio to their shapes"):
        bodies.check_start(longer, made)
