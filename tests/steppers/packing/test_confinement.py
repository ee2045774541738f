"""Packings in containers: attempts against a NumPy reference, scaling, closed forms, bits, and refusals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.scenes import compiled, simulate
from tests.steppers.packing.bits import resumed, same_bits
from tests.steppers.packing.test_mechanical_contraction import (
    CUBOID,
    ELLIPSOID,
    ROD,
    SPHERE,
    attempt,
    contact,
    deepest,
    hard,
)
from tisim import Box, InputError, Particles, Scene, Simulation, run
from tisim.effects import Confinement
from tisim.geometry import BoxContainer, CylindricalContainer, SphericalContainer, WedgeContainer
from tisim.packing import random_bodies, wall_gaps
from tisim.shapes import SpherocylinderShape
from tisim.steppers import EnergyMinimisation, FixedStep, MechanicalContraction, Verlet

pytestmark = pytest.mark.long

CYLINDER, SPHERICAL = CylindricalContainer(diameter=4.0), SphericalContainer()
WEDGE = WedgeContainer(length=7.0, angle=np.radians(35))
SLIT = BoxContainer(hard=(True, False, True), width=(3.0, 0.0, 0.0))
CONTAINERS = (CYLINDER, WEDGE, SLIT, SPHERICAL)
TREATMENTS = ("exact", "virtual")
TOLERANCE = 1e-4
NUMBER = 80
LIMITS = {"attempts": 200, "halvings": 2}
"""The same in attempts and packings, so that those of one container share a compiled simulation."""


def scene(
    container, shape=ROD, number=NUMBER, fraction=0.15, seed=0, treatment="exact", margin=None, **settings
):
    """Bodies at random inside a container; with a margin, their centres alone, that far away from walls."""
    start = random_bodies(shape, number, fraction, container, seed)
    given = start.particles()
    if margin is not None:
        numbers = np.random.default_rng(seed).uniform(size=(number, 3))
        unit = 2 * min(shape.half_extents())
        given["position"] = container.points(numbers, np.array(start.box.high), unit, margin)
    return Scene(
        particles=Particles(**given),
        effects=[hard(shape), Confinement(container=container, treatment=treatment)],
        domain=start.box,
        duration=settings.pop("duration", 1e6),
        stepper=settings.pop("stepper", None) or MechanicalContraction(**settings),
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
    """The overlaps of a body with walls, for ``attempt``: of each end of a rod, or of the farthest point."""
    walls, rod = faces(container, side), shape.rod()
    half, radius = rod or (0.0, 0.0)

    def overlaps(place, turn):
        found = []
        for sign in (1, -1) if half else (1,):
            end = turn.apply([0.0, 0.0, sign * half])
            for distance, direction in walls:
                gap, outward = distance(place + end)
                body = turn.apply(shape.support(turn.inv().apply(outward)))
                here = end + radius * outward if rod else body
                depth, normal = (here - end) @ outward - gap, outward
                if treatment == "virtual" and 0 < depth < 0.5:
                    # B16: beyond the wall by the half width of the body.
                    beyond = here + (shape.half_extents()[0] - depth) * outward
                    z = direction(outward)
                    virtual = Rotation.from_matrix(np.stack([outward, np.cross(z, outward), z], axis=1))
                    other = radius - distance(place - end)[0] if half else -np.inf
                    exact, (depth, normal, here, _) = depth, contact((shape, shape), beyond, turn, virtual)
                    seen.append((depth - exact, exact >= other and not container.curved))
                found.append((depth, -normal, here))
        return found

    return overlaps


SMALL_WEDGE = WedgeContainer(length=4.0, angle=0.6)
ATTEMPTS = [
    (ROD, CYLINDER, "original", "exact"),
    (ROD, CYLINDER, "revised", "virtual"),
    (ROD, WEDGE, "original", "exact"),
    (ROD, WEDGE, "revised", "virtual"),
    (ROD, SLIT, "revised", "exact"),
    (ROD, SLIT, "original", "virtual"),
    (ROD, SPHERICAL, "original", "exact"),
    (ROD, SPHERICAL, "revised", "virtual"),
    (ELLIPSOID, SMALL_WEDGE, "revised", "exact"),
    (ELLIPSOID, SMALL_WEDGE, "revised", "virtual"),
    (CUBOID, SMALL_WEDGE, "revised", "exact"),
    (CUBOID, SMALL_WEDGE, "revised", "virtual"),
]


QUICK_ATTEMPTS = (ATTEMPTS[0], ATTEMPTS[3])
"""A rod by exact distances, and a rod by virtual bodies."""


@pytest.mark.parametrize(
    ("shape", "container", "method", "treatment"),
    [pytest.param(*one, marks=() if one in QUICK_ATTEMPTS else pytest.mark.slow) for one in ATTEMPTS],
    ids=[f"{shape.kind()}-{container.kind()}-{treatment}" for shape, container, _, treatment in ATTEMPTS],
)
def test_an_attempt_equals_its_reference(shape, container, method, treatment):
    """Many bodies protrude, rods by up to their whole length."""
    made = scene(container, shape, treatment=treatment, margin=0.0, method=method, **LIMITS)
    within = 1e-10 if shape.rod() else 1e-9
    side, seen = np.array(made.domain.high), []
    walls = reference_walls(container, side, shape, treatment, seen)
    periodic = [not hard for hard in container.walled()]
    simulation = compiled(made, capacity=NUMBER)
    simulation.load([made])
    for _ in range(4):
        before = {name: np.array(simulation.state[name]) for name in ("position", "orientation")}
        places, orientations = attempt(before, side, shape, method, periodic=periodic, walls=walls)
        simulation.run(steps=1)
        after = {name: np.array(simulation.state[name]) for name in before}
        np.testing.assert_allclose(after["position"], places, rtol=0, atol=within)
        found = Rotation.from_quat(after["orientation"], scalar_first=True).as_matrix()
        axes = slice(None) if shape.rod() is None else 2
        np.testing.assert_allclose(found[:, :, axes], orientations[:, :, axes], rtol=0, atol=within)
    if treatment == "virtual":
        # The overlap of a virtual body is the depth of the deeper end behind a plane. For the other end, and
        # behind curved walls, it may be larger, by another point of the rod.
        assert len(seen) > 20
        assert min(one for one, _ in seen) > -1e-9
        assert max((one for one, same in seen if same), default=0.0) < 1e-9


def packed(result):
    """Shape, container, size of the bodies over the shape, and sides of the box of a packing."""
    bodies, around = result.scene.effects
    (shape,) = bodies.shapes()
    size = float(result.state["radius"][0]) / shape.bounding_radius()
    return shape, around.container, size, np.array(result.scene.domain.high)


def gaps(result):
    """The least gap between bodies and walls, in D."""
    shape, container, size, side = packed(result)
    found = wall_gaps(shape, result.state["position"], result.state["orientation"], container, side, size)
    return found.min() / (size * 2 * shape.half_extents().min())


def overlap(result):
    """The deepest overlap between bodies, in D."""
    shape, _, size, side = packed(result)
    return deepest(result.state, side, shape, size * shape.bounding_radius(), result.scene.domain.periodic)


def fraction(result):
    shape, container, size, side = packed(result)
    volume = container.volume_in(side, size * 2 * shape.half_extents().min())
    return len(result.state["radius"]) * shape.volume() * size**3 / volume


PACKINGS = [
    *((ROD, one, "exact") for one in CONTAINERS),
    *((SPHERE, one, "virtual") for one in CONTAINERS),
    (ROD, WEDGE, "virtual"),
    (ELLIPSOID, SLIT, "exact"),
]


@pytest.mark.parametrize(
    ("shape", "container", "treatment"),
    [pytest.param(*one, marks=[pytest.mark.slow] * (one != PACKINGS[0])) for one in PACKINGS],
    ids=[f"{shape.kind()}-{container.kind()}-{treatment}" for shape, container, treatment in PACKINGS],
)
def test_a_packing_has_no_overlaps_with_bodies_or_walls(shape, container, treatment):
    given = {"method": "original"} if shape.rod() else {"motion": 0.5, "duration": 500.0}
    made = scene(container, shape, treatment=treatment, volume_step=4.0, **LIMITS, **given)
    (result,) = simulate([made], capacity=NUMBER)
    assert result.status.ok
    assert result.time < made.duration or not shape.rod()
    assert (0.3 if shape.rod() else 0.2) < fraction(result) < 0.7
    assert -gaps(result) <= TOLERANCE * (1 + 1e-9)
    assert overlap(result) <= TOLERANCE * (1 + 1e-9)
    # Some bodies touch walls.
    assert gaps(result) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("container", [CYLINDER, WEDGE], ids=lambda one: one.kind())
def test_energy_minimisation_packs_between_walls(container):
    made = scene(container, SPHERE, 60, fraction=0.2, stepper=EnergyMinimisation())
    result = run(made)
    assert result.status.ok
    assert 0.4 < fraction(result) < 0.7
    assert 0 < -gaps(result) <= TOLERANCE * (1 + 1e-9)
    assert overlap(result) <= TOLERANCE * (1 + 1e-9)


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("container", CONTAINERS, ids=lambda one: one.kind())
def test_a_container_grows_with_its_bodies(container):
    """In a contraction without overlaps bodies move along the scaled axes alone, away from the middle of the
    box or the apex of the wedge, and the volume decreases by its step."""
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
            centre = 0.0 if container is WEDGE else side / 2
            moved = centre + np.where(scaled, growth, 1.0) * (before["position"] - centre)
            np.testing.assert_allclose(after["position"], moved, rtol=0, atol=1e-12)
            (measures,) = simulation.measures([0])
            solid = 48 * SPHERE.volume() * (2 * after["radius"][0]) ** 3
            assert measures["packing_fraction"] == pytest.approx(solid / volumes[1], rel=1e-9)
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
        effects=[hard(shape), Confinement(container=container)],
        domain=Box(low=(0, 0, 0), high=tuple(box), periodic=periodic),
        duration=1e6,
        stepper=MechanicalContraction(method="original", volume_step=0.1, attempts=300, **settings),
    )


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_bits_do_not_depend_on_batch_portions_or_checkpoint(tmp_path):
    """In wedges of different lengths, whose bodies begin behind the walls in part."""
    scenes = [
        scene(
            WedgeContainer(length=7.0 + k, angle=0.5), number=80 + k, seed=k, duration=300.0, margin=0.3,
            method="original", treatment="virtual",
        )
        for k in range(3)
    ]  # fmt: skip
    usual = same_bits(scenes, tmp_path, 37)
    assert usual[1].work["contractions"] > 0


@pytest.mark.slow
def test_a_resumed_packing_returns_to_its_last_configuration(tmp_path):
    made = scene(CYLINDER, SPHERE, attempts=60, volume_step=8.0, method="original", halvings=1)
    assert -gaps(resumed(made, tmp_path)) <= TOLERANCE * (1 + 1e-9)


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
        ({"effects": [around]}, "effects must be one with hard bodies beside confinement"),
        ({"stepper": Verlet(control=FixedStep(dt=1.0))}, "stepper must be one that packs"),
    ):
        with pytest.raises(InputError, match=message):
            Scene(**{**parts, **change})
    longer = made.start() | {"radius": np.linspace(1.0, 1.1, 80)}
    with pytest.raises(InputError, match=r"particles.radius must be in one ratio to their shapes"):
        around.check_start(longer, made)


@pytest.mark.slow
def test_a_container_must_stay_long_enough_for_its_bodies():
    """A cylinder with few rods becomes shorter than two of them; its width does not count."""
    made = scene(CYLINDER, number=20, method="original", volume_step=2.0)
    result = run(made)
    assert "bodies longer than half the periodic box; take more bodies" in result.status.reason
    assert 4 * result.state["radius"][0] == pytest.approx(made.domain.high[2], rel=0.03)


def test_superquadrics_are_refused_in_curved_containers():
    made = scene(CYLINDER)
    rule = "effects.hard_superquadrics must be rods or spheres in a cylindrical_container, as round ends"
    with pytest.raises(InputError, match=rule):
        Scene(
            particles=made.particles,
            effects=[hard(ELLIPSOID), made.effects[1]],
            domain=made.domain,
            duration=1.0,
            stepper=MechanicalContraction(),
        )
