"""Mechanical contraction: single attempts against a NumPy reference, and packings without overlaps."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from tests.scenes import compiled, simulate
from tests.shapes.pairs import Bodies, RodsOfPairs, superquadric_contacts
from tests.steppers.packing.bits import resumed, same_bits
from tisim import Box, InputError, Particles, Scene, run
from tisim.effects import Gravity
from tisim.effects.contact.hard_rods import HardRods
from tisim.effects.contact.hard_superquadrics import HardSuperquadrics
from tisim.shapes import SpherocylinderShape, SuperquadricShape
from tisim.shapes.superquadric_points import SUPERQUADRICS, WITH_RODS
from tisim.steppers import FixedStep, Verlet
from tisim.steppers.packing.mechanical_contraction import MechanicalContraction

ROD, SPHERE = SpherocylinderShape(length=1.5, diameter=1.0), SpherocylinderShape(length=0.0, diameter=1.0)
ELLIPSOID = SuperquadricShape(semi_axes=(0.5, 0.8, 1.2), exponents=(2.0, 2.0, 2.0))
CUBOID = SuperquadricShape(semi_axes=(0.8, 0.5, 1.0), exponents=(5.0, 3.0, 4.0))
METHODS = ("revised", "original")
CAPACITY, ATTEMPTS = 100, 400
"""The same in most tests, so that those of one structure share a compiled simulation."""


def hard(shape):
    """The effect of hard bodies of one shape."""
    if isinstance(shape, SuperquadricShape):
        return HardSuperquadrics(superquadrics=(shape,))
    return HardRods(rods=(shape,))


def scene(shape, number, fraction=0.05, seed=0, duration=1000.0, **settings):
    """Bodies at random places of a cubic box; they may overlap."""
    side = (number * shape.volume() / fraction) ** (1 / 3)
    particles = Particles(
        position=np.random.default_rng(seed).uniform(0, side, (number, 3)),
        velocity=np.zeros((number, 3)),
        mass=np.ones(number),
        radius=np.full(number, shape.bounding_radius()),
    )
    return Scene(
        particles=particles,
        effects=[hard(shape)],
        domain=Box(low=(0, 0, 0), high=(side, side, side)),
        duration=duration,
        stepper=MechanicalContraction(**settings),
        seed=seed,
    )


def contact(shapes, separation, turn_i, turn_j, size=1.0):
    """Overlap, normal from i to j, and points of contact of two bodies of two shapes.

    Those of superquadrics come from their kernel, which tests/shapes compares with other means.
    """
    if not any(shape.superquadric() for shape in shapes):
        axis_i, axis_j = (turn.apply([0.0, 0.0, 1.0]) for turn in (turn_i, turn_j))
        sizes = [(size * shape.length / 2, size * shape.diameter / 2) for shape in shapes]
        return rod_contact(separation, axis_i, axis_j, *sizes)
    bodies, family = [], SUPERQUADRICS
    for shape, turn in zip(shapes, (turn_i, turn_j), strict=True):
        one = Rotation.concatenate([turn])
        if shape.superquadric():
            bodies.append(Bodies(one, *(np.array(shape.superquadric())[:, None] * [[[size]], [[1.0]]])))
        else:
            rod, family = size * np.array([[shape.length / 2], [shape.radius]]), WITH_RODS
            bodies.append(RodsOfPairs(one, *rod))
    found = superquadric_contacts(separation[None], *bodies, family=family)
    return -found.gap[0], found.normal[0], found.point_i[0], found.point_j[0]


def rod_contact(separation, axis_i, axis_j, rod_i, rod_j):
    """The same for two rods, given by half the lengths of their segments and their radii, by least squares
    within bounds."""
    # Both ends lie on segments: least squares within bounds, by an active set, which is exact.
    axes, limits = np.stack([axis_i, -axis_j], axis=1), np.array([rod_i[0], rod_j[0]]) + 1e-300
    a, b = lsq_linear(axes, separation, (-limits, limits), method="bvls", tol=1e-15).x
    apart = separation + b * axis_j - a * axis_i
    distance = np.linalg.norm(apart)
    normal = apart / distance
    here, there = a * axis_i + rod_i[1] * normal, b * axis_j - rod_j[1] * normal
    return rod_i[1] + rod_j[1] - distance, normal, here, there


def attempt(
    state, side, shape, method, dt=0.1, beta=0.5, tolerance=1e-4, periodic=(True, True, True), walls=None
):
    """Positions and orientations after one attempt to remove the overlaps; B16 (2.7)-(2.10), (3.6)-(3.13).

    shape : the shape of all bodies, or one for each. walls : function of the place and the rotation of a body
    that returns its overlaps with walls: depth, normal along which it leaves the wall, and point of contact.
    """
    x, turns = state["position"], Rotation.from_quat(state["orientation"], scalar_first=True)
    number = len(x)
    shapes = shape if isinstance(shape, list) else [shape] * number
    touching = [[] for _ in range(number)]
    for i in range(number):
        for j in range(i):
            d = x[j] - x[i]
            d -= np.where(periodic, side * np.round(d / side), 0)
            both = shapes[i], shapes[j]
            if np.linalg.norm(d) > sum(one.bounding_radius() for one in both):
                continue
            depth, normal, here, there = contact(both, d, turns[i], turns[j])
            if depth > tolerance:
                touching[i].append((depth, -normal, here))
                touching[j].append((depth, normal, there))
    others = [len(contacts) for contacts in touching]
    if walls is not None:
        for contacts, place, turn in zip(touching, x, turns, strict=True):
            contacts += [found for found in walls(place, turn) if found[0] > tolerance]
    places, orientations = x.copy(), turns.as_matrix()
    for i, contacts in enumerate(touching):
        if not contacts:
            continue
        # The weight of a wall that is deeper than D/2 is constant.
        depths = [min(one[0], 0.5) if k >= others[i] else one[0] for k, one in enumerate(contacts)]
        weights = [depth * (1 - depth) if method == "original" else 1.0 for depth in depths]
        push = sum(weight * n for weight, (_, n, _) in zip(weights, contacts, strict=True))
        twist = sum(weight * np.cross(r, n) for weight, (_, n, r) in zip(weights, contacts, strict=True))
        body, mass, moments = orientations[i], shapes[i].volume(), shapes[i].moments()
        tensor = body @ np.diag(mass * moments) @ body.T
        if method == "revised":
            spin = np.linalg.solve(tensor, twist)
            multiplier = np.sqrt(0.5 * (push @ push / mass + twist @ spin))
            step = dt * min(depth for depth, _, _ in contacts) / multiplier
            shift, turn = step * push / mass, step * spin
        else:
            spin = twist / moments[0]
            rates = [((push + np.cross(spin, r)) @ n) / depth for depth, n, r in contacts]
            step = beta / max(rates)
            shift, turn = step * push, step * spin
        places[i] = np.where(periodic, (x[i] + shift) % side, x[i] + shift)
        orientations[i] = Rotation.from_rotvec(turn).as_matrix() @ body
    return places, orientations


@pytest.mark.parametrize(
    ("shape", "method"),
    [
        # Rods and superquadrics in the revised method are among the mixtures of test_mixtures.py.
        pytest.param(ROD, "revised", marks=pytest.mark.slow),
        (ROD, "original"),
        (SPHERE, "revised"),
        pytest.param(SPHERE, "original", marks=pytest.mark.slow),
        pytest.param(ELLIPSOID, "revised", marks=pytest.mark.slow),
        pytest.param(CUBOID, "revised", marks=pytest.mark.slow),
    ],
)
def test_an_attempt_equals_its_reference(shape, method):
    """Until the first contraction, from deep overlaps on."""
    made = scene(shape, 100, 0.08, method=method, attempts=ATTEMPTS)
    side, simulation = made.domain.high[0], compiled(made, capacity=CAPACITY)
    simulation.load([made])
    moved = 0.0
    for _ in range(4):
        before = {name: np.array(simulation.state[name]) for name in ("position", "orientation")}
        places, orientations = attempt(before, side, shape, method)
        simulation.run(steps=1)
        after = {name: np.array(simulation.state[name]) for name in before}
        np.testing.assert_allclose(after["position"], places, rtol=0, atol=1e-10)
        found = Rotation.from_quat(after["orientation"], scalar_first=True).as_matrix()
        # Of rods the axis alone: a rotation about it moves nothing.
        turned = slice(0, 3) if shape.superquadric() else slice(2, 3)
        np.testing.assert_allclose(found[:, :, turned], orientations[:, :, turned], rtol=0, atol=1e-10)
        moved = max(moved, np.abs(after["position"] - before["position"]).max())
    assert moved > 0.01


def deepest(state, side, shape, size, periodic=(True, True, True)):
    """The deepest overlap, in D."""
    x, scaled = state["position"], size / shape.bounding_radius()
    turns = Rotation.from_quat(state["orientation"], scalar_first=True)
    unit, depths = 2 * scaled * min(shape.half_extents()), []
    for i in range(len(x)):
        d = x[:i] - x[i]
        d -= np.where(periodic, side * np.round(d / side), 0)
        for j in np.flatnonzero(np.linalg.norm(d, axis=1) < 2 * size):
            depths.append(contact((shape, shape), d[j], turns[i], turns[j], scaled)[0] / unit)
    return max(depths)


def fraction(result, shape):
    size = result.state["radius"][0] / shape.bounding_radius()
    return len(result.state["radius"]) * shape.volume() * size**3 / result.scene.domain.high[0] ** 3


@pytest.mark.parametrize(
    ("shape", "method", "attempts"),
    [
        (SPHERE, "revised", ATTEMPTS),
        (SPHERE, "original", ATTEMPTS),
        pytest.param(ROD, "original", ATTEMPTS, marks=pytest.mark.slow),
        pytest.param(ELLIPSOID, "revised", 50, marks=pytest.mark.slow),
    ],
)
def test_a_packing_has_no_overlaps_and_cannot_be_contracted(shape, method, attempts):
    # Longer motions than B16's 0.1 need fewer attempts, and pack a little less densely.
    options = {"method": method, "attempts": attempts, "volume_step": 2.0, "motion": 0.5}
    made = scene(shape, 100, 0.2, duration=1e6, **options)
    (result,) = simulate([made], capacity=CAPACITY)
    assert result.status.ok
    assert result.work["jammed"] == 1
    assert result.status.reason == "jammed: its bodies could not be brought closer"
    assert result.time < 1e6
    assert 0.45 < fraction(result, shape) < 0.72
    depth = deepest(result.state, made.domain.high[0], shape, result.state["radius"][0])
    assert -0.01 < depth <= 1e-4 * (1 + 1e-9)


@pytest.mark.slow
def test_a_run_that_ends_before_it_is_jammed_returns_a_configuration_without_overlaps():
    for duration in (60.0, 95.0, 130.0):
        made = scene(ROD, 100, 0.05, duration=duration, method="original")
        result = run(made)
        size = result.state["radius"][0]
        assert deepest(result.state, made.domain.high[0], ROD, size) <= 1e-4 * (1 + 1e-9)
        assert result.work["contractions"] > 0
        assert result.work["jammed"] == 0
        assert result.status.reason == "reached its end"
        assert result.measures["packing_fraction"] == pytest.approx(fraction(result, ROD), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "number", "options"),
    [
        (ROD, 100, {"method": "original"}),
        (ROD, 100, {"method": "revised", "motion": 0.5}),
        (CUBOID, 40, {"method": "revised", "motion": 0.5}),
    ],
)
def test_the_bits_do_not_depend_on_batch_portions_or_checkpoint(tmp_path, shape, number, options):
    scenes = [scene(shape, number + k, 0.05, seed=k, duration=90.0, **options) for k in range(3)]
    results = same_bits(scenes, tmp_path, 17)
    assert min(one.work["contractions"] for one in results) > 0


def test_other_effects_and_domains_are_refused():
    made = scene(ROD, 100)
    parts = {name: getattr(made, name) for name in ("particles", "effects", "domain", "duration", "stepper")}
    flat = Box(low=(0, 0, 0), high=made.domain.high, periodic=(True, True, False))
    for change, message in (
        ({"effects": [*made.effects, Gravity()]}, "effects.gravity must be hard bodies alone"),
        ({"domain": flat}, "domain must be a periodic box for mechanical_contraction, or one with an effect"),
        (
            {"effects": [hard(ELLIPSOID)], "stepper": MechanicalContraction(method="original")},
            "method must be 'revised' for bodies that are not rods; received 'original'",
        ),
        ({"effects": [Gravity()]}, "effects must be one with hard bodies for mechanical_contraction"),
    ):
        with pytest.raises(InputError, match=message):
            Scene(**{**parts, **change})
    rule = "stepper must be one that packs, such as mechanical_contraction, with effects.hard_rods"
    with pytest.raises(InputError, match=rule):
        Scene(**{**parts, "stepper": Verlet(control=FixedStep(dt=1.0))})


def test_a_box_must_be_wide_enough_for_its_bodies():
    """At the start, and while they grow."""
    given = {"method": "original", "attempts": ATTEMPTS}
    with pytest.raises(InputError, match="box must be at least 10 m wide where it is periodic"):
        simulate([scene(SpherocylinderShape(length=4.0, diameter=1.0), 9, **given)], capacity=CAPACITY)
    made = scene(ROD, 30, duration=1e5, volume_step=2.0, **given)
    (result,) = simulate([made], capacity=CAPACITY)
    assert "bodies longer than half the periodic box; take more bodies" in result.status.reason
    assert 4 * result.state["radius"][0] == pytest.approx(made.domain.high[0], rel=1e-2)


def test_quaternions_and_shapes_of_a_start_are_checked():
    made = scene(ROD, 100)
    for name, value, message in (
        ("orientation", np.full((100, 4), 1.0), "particles.orientation must be unit quaternions"),
        ("shape", np.full(100, 1), "particles.shape must be below 1, the shapes"),
    ):
        start = made.start() | {name: value}
        with pytest.raises(InputError, match=message):
            made.effects[0].check_start(start, made)


@pytest.mark.slow
def test_shapes_may_be_given_for_each_body():
    kinds, shapes = np.arange(60) % 2, (ROD, SPHERE)
    bounding = np.array([one.bounding_radius() for one in shapes])
    made = scene(ROD, 60)
    particles = Particles(
        position=made.particles.position,
        velocity=np.zeros((60, 3)),
        mass=np.ones(60),
        radius=0.5 * bounding[kinds],
        quantities={"shape": kinds},
    )
    both = Scene(
        particles=particles,
        effects=[HardRods(rods=shapes)],
        domain=made.domain,
        duration=30.0,
        stepper=MechanicalContraction(method="original"),
    )
    np.testing.assert_array_equal(both.start()["shape"], kinds)
    assert both.effects[0].unit_of(both.start()) == pytest.approx(0.5, rel=1e-12)
    result = run(both).check()
    growth = result.state["radius"] / particles.radius
    np.testing.assert_array_equal(result.state["shape"], kinds)
    np.testing.assert_allclose(growth, growth[0], rtol=1e-12)


@pytest.mark.parametrize("order", [1, -1])
def test_a_small_body_inside_a_large_one_moves_out(order):
    """In the original method, whichever of both gives D, and also from a common centre."""
    shapes = (SPHERE, SpherocylinderShape(length=0.0, diameter=10.0))[::order]
    for distance in (0.0, 2.0):
        particles = Particles(
            position=[[20.0, 20.0, 20.0], [20.0 + distance, 20.0, 20.0]],
            velocity=np.zeros((2, 3)),
            mass=1.0,
            radius=[one.bounding_radius() for one in shapes],
            quantities={"shape": [0, 1]},
        )
        made = Scene(
            particles=particles,
            effects=[HardRods(rods=shapes)],
            domain=Box(low=(0, 0, 0), high=(40, 40, 40)),
            duration=40.0,
            stepper=MechanicalContraction(method="original", volume_step=1e-9),
        )
        state = run(made).check().state
        assert np.linalg.norm(np.diff(state["position"], axis=0)) == pytest.approx(5.5, rel=1e-3)


def test_orientations_of_a_start_are_random_unless_given():
    made = scene(ROD, 400)
    axes = Rotation.from_quat(made.start()["orientation"], scalar_first=True).apply([0.0, 0.0, 1.0])
    # Each component has the variance 1/3, known to 5 standard errors.
    assert np.abs((axes**2).mean(axis=0) - 1 / 3).max() < 5 * np.sqrt(4 / 45 / 400)
    other = scene(ROD, 400, seed=1).start()["orientation"]
    assert np.abs(other - made.start()["orientation"]).max() > 0.1


@pytest.mark.slow
def test_a_run_that_never_removes_the_overlaps_of_its_start_fails():
    result = run(scene(ROD, 100, 0.3, duration=3.0, method="original"))
    assert result.status.failed
    assert "overlaps of the start were not removed" in result.status.reason


@pytest.mark.slow
def test_a_resumed_run_returns_to_its_last_configuration(tmp_path):
    made = scene(SPHERE, 100, 0.45, duration=1e5, attempts=60, volume_step=8.0, method="original", halvings=1)
    result = resumed(made, tmp_path)
    size = result.state["radius"][0]
    assert deepest(result.state, made.domain.high[0], SPHERE, size) <= 1e-4 * (1 + 1e-9)
