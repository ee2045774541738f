"""Rigid rods and superquadrics: free tops, collisions, walls, heaps, against NumPy references and closed
forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.effects.constraint.shapes import (
    BALL,
    BRICK,
    DENSITY,
    EGG,
    LYING,
    ROD,
    D,
    axis,
    energy,
    momentum,
    moving,
    reference,
    whole_momentum,
)
from tests.scenes import by_id, compiled, fixed, simulate
from tisim import Box, Clump, GrainClass, InputError, Material, Particles, Scene
from tisim.analysis import clump_bodies
from tisim.effects import (
    Granular,
    Gravity,
    Hertz,
    HertzMaterial,
    Hooke,
    LinearSpring,
    MindlinForce,
    PrescribedMotion,
    RestitutionDamping,
    RigidClumps,
    RollingEPSD,
    StokesDrag,
    TwistingMarshall,
    Walls,
)
from tisim.geometry import Disc, Plane
from tisim.operators import AtRest, InsertionByFlux
from tisim.packing import EqualSizes
from tisim.steppers import Boris, FixedStep

pytestmark = pytest.mark.long
SHAPES = {"rods": ROD, "eggs": EGG, "bricks": BRICK}
QUICK_SHAPES = ["rods", *(pytest.param(name, marks=pytest.mark.slow) for name in ("eggs", "bricks"))]
ELASTIC = Granular(normal=HertzMaterial())
LAW = Granular(
    normal=HertzMaterial(),
    damping=RestitutionDamping(),
    tangential=MindlinForce(),
    rolling=RollingEPSD(),
    twisting=TwistingMarshall(),
)
USUAL = {"young": 1e7, "poisson": 0.3, "restitution": 0.7, "friction": 0.5, "rolling_friction": 0.1}
TURNS = Rotation.from_rotvec([[1.2, 0.1, 0.2], [0.3, 0.2, 0.9]]).as_quat(scalar_first=True)
WEIGHT = Gravity(acceleration=(0, 0, -9.81))
WEIGHTLESS = Gravity(acceleration=(0, 0, 0))
"""For bodies without weight in a compiled scene of bodies with weight."""
FLOOR = Walls(planes=[Plane(normal=(0, 0, 1))])


def material(**changes):
    return {"grain": Material(**{**USUAL, **changes})}


def colliding(body, law=ELASTIC, dt=1e-6, time=4e-3, **changes):
    """Two bodies that run into each other off centre, spinning."""
    given = {
        "velocity": [(0.3, 0.02, 0), (-0.3, 0.01, 0.05)],
        "orientation": TURNS,
        "angular_velocity": [(30, 20, -50), (0, 100, 20)],
        **changes,
    }
    place = [(-1.5e-3, 0, 0), (1.5e-3, 0.3e-3, 0.2e-3)]
    more = {"materials": material(), **given}
    return moving(body, place, (law,), dt, round(time / dt), **more)


def top(shape, spin, dt, steps):
    return moving(shape, [(0, 0, 0)], (), dt, steps, velocity=(0.1, 0.2, 0.3), orientation=TURNS[0],
                  angular_velocity=spin)  # fmt: skip


def turned_apart(p, q):
    """The angle (rad) between two orientations."""
    both = Rotation.from_quat(p, scalar_first=True).inv() * Rotation.from_quat(q, scalar_first=True)
    return both.magnitude()


@pytest.mark.parametrize("shape", [EGG, BRICK, ROD], ids=["egg", "brick", "rod"])
def test_a_free_top_keeps_its_angular_momentum_and_turns_to_second_order(shape):
    time, spin, errors, energies = 0.02, (100.0, 400.0, -300.0), [], []
    begin = top(shape, spin, 1e-4, 1)
    mass, moments = begin.start()["mass"][0], begin.start()["mass"][0] * shape.moments()
    # The same by small steps of the rotation vector, at fourth order (Runge and Kutta).
    turn = Rotation.from_quat(TURNS[0], scalar_first=True)
    momentum_ = turn.apply(moments * turn.inv().apply(spin))

    def rate(q):
        r = Rotation.from_quat(q / np.linalg.norm(q), scalar_first=True)
        w = r.apply(r.inv().apply(momentum_) / moments)
        return 0.5 * np.array([-w @ q[1:], *(q[0] * w + np.cross(w, q[1:]))])

    q, h = np.array(TURNS[0]), time / 1000
    for _ in range(1000):
        k1 = rate(q)
        k2 = rate(q + h / 2 * k1)
        k3 = rate(q + h / 2 * k2)
        q = q + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(q + h * k3))
    for steps in (100, 200, 400):
        (result,) = simulate([top(shape, spin, time / steps, steps)])
        start, end = result.start, result.state
        np.testing.assert_array_equal(end["angular_momentum"], start["angular_momentum"])
        np.testing.assert_allclose(start["angular_momentum"][0], momentum_, rtol=1e-12, atol=0)
        np.testing.assert_allclose(end["position"][0], np.array([0.1, 0.2, 0.3]) * time, rtol=1e-13)
        np.testing.assert_allclose(start["spin"][0], spin, rtol=1e-12)
        errors.append(turned_apart(end["orientation"][0], q))
        energies.append(abs(energy(end) / energy(start) - 1))
    assert mass == pytest.approx(DENSITY * shape.volume(), rel=1e-14)
    if shape is ROD:
        # The rotations about both equal axes follow each other, so a symmetric top is of second order too.
        assert errors[0] > 1e-6
    assert errors[0] < 0.02
    np.testing.assert_allclose(np.log2(np.array(errors)[:-1] / errors[1:]), 2.0, atol=0.1)
    assert energies[2] < 2e-5


@pytest.mark.parametrize("name", ["rods", pytest.param("eggs", marks=pytest.mark.slow)])
def test_two_bodies_collide_as_in_a_numpy_reference(name):
    shape, errors = SHAPES[name], []
    effective = USUAL["young"] / (2 * (1 - USUAL["poisson"] ** 2))
    radius = shape.contact_radius() / 2

    def push(overlap):
        return 4 / 3 * effective * np.sqrt(radius) * overlap**1.5

    x, v, q, momenta, _ = reference(colliding(shape), shape, push, 4e-3)
    start = colliding(shape).start()
    assert np.abs(v - start["velocity"]).min(axis=1).max() > 0.01
    for dt in (1e-5, 5e-6):
        (result,) = simulate([colliding(shape, dt=dt)])
        state = result.state
        parts = (
            np.abs(state["position"] - x).max() / D,
            np.abs(state["velocity"] - v).max() / 0.3,
            max(turned_apart(p, r) for p, r in zip(state["orientation"], q, strict=True)),
            np.abs(state["angular_momentum"] - momenta).max() / np.abs(momenta).max(),
        )
        errors.append(max(parts))
    assert errors[0] < 5e-4
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.slow
def test_rods_stick_by_springs_as_in_a_numpy_reference():
    """A spring without slip. It begins at the end of the step in which the rods meet, so the error is between
    0 and a limit of first order in dt."""
    stiffness, kappa, errors = 300.0, 2 / 7, []
    law = Granular(normal=Hooke(), tangential=LinearSpring(stiffness_ratio=kappa))
    given = {"materials": {"grain": Material(stiffness=stiffness, friction=1e3)}}
    made = colliding(ROD, law, **given)
    x, v, q, momenta, _ = reference(made, ROD, lambda deep: stiffness * deep, 4e-3, kappa * stiffness)
    smooth = reference(made, ROD, lambda deep: stiffness * deep, 4e-3)
    assert np.abs(v - smooth[1]).max() > 0.03
    for dt in (2e-6, 2.5e-7):
        (result,) = simulate([colliding(ROD, law, dt, **given)])
        state = result.state
        assert result.status.ok, result.status.reason
        parts = (
            np.abs(state["position"] - x).max() / D,
            np.abs(state["velocity"] - v).max() / 0.3,
            max(turned_apart(p, r) for p, r in zip(state["orientation"], q, strict=True)),
            np.abs(state["angular_momentum"] - momenta).max() / np.abs(momenta).max(),
        )
        errors.append(max(parts))
    np.testing.assert_array_less(errors, [3e-3, 4e-4])


@pytest.mark.parametrize("name", QUICK_SHAPES)
def test_an_elastic_collision_keeps_energy_momentum_and_angular_momentum(name):
    errors = []
    for dt in (2e-6, 1e-6, 5e-7):
        (result,) = simulate([colliding(SHAPES[name], dt=dt)])
        start, end = result.start, result.state
        size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
        np.testing.assert_allclose(momentum(end), momentum(start), rtol=0, atol=1e-14 * size)
        np.testing.assert_allclose(whole_momentum(end), whole_momentum(start), rtol=0, atol=1e-12 * size * D)
        assert np.abs(end["velocity"] - start["velocity"]).max() > 0.1
        assert np.abs(end["spin"] - start["spin"]).max() > 10
        errors.append(abs(energy(end) / energy(start) - 1))
    assert errors[0] < 2e-5
    assert max(errors[1:]) < 3e-6
    assert errors[2] < 0.3 * errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK_SHAPES)
def test_friction_and_rolling_keep_momentum_and_angular_momentum(name):
    (result,) = simulate([colliding(SHAPES[name], LAW)])
    start, end = result.start, result.state
    size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
    np.testing.assert_allclose(momentum(end), momentum(start), rtol=0, atol=1e-14 * size)
    np.testing.assert_allclose(whole_momentum(end), whole_momentum(start), rtol=0, atol=1e-12 * size * D)
    assert 0.2 < energy(end) / energy(start) < 0.8


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK_SHAPES)
def test_restitution_holds_wherever_a_body_hits_a_floor(name):
    """Without friction the impulse is J = (1 + e) u / (1/m + (r x n) I^-1 (r x n)), for a point of contact r
    that approaches at a speed u."""
    shape, speed = SHAPES[name], 0.3
    law, stiff = Granular(damping=RestitutionDamping()), material(young=1e9)
    turn, height = Rotation.from_rotvec([0.3, 0.5, 0.2]), 1.001 * shape.bounding_radius()
    made = moving(
        shape, [(0, 0, height)], (law, FLOOR), 2e-8, velocity=(0.1, 0, -speed), materials=stiff,
        orientation=turn.as_quat(scalar_first=True), angular_velocity=(5, -3, 10),
    )  # fmt: skip
    # It hits the floor halfway, turning by a hundredth of a radian before.
    low = shape.support(turn.inv().apply([[0.0, 0.0, -1.0]]))
    fall = (height + turn.apply(low)[0, 2]) / speed
    (result,) = simulate([made.model_copy(update={"duration": 2 * fall + 1e-4})])
    assert result.status.ok, result.status.reason
    start, end = result.start, result.state
    mass, before, after = end["mass"][0], start["velocity"][0], end["velocity"][0]
    impulse = mass * (after - before)
    np.testing.assert_allclose(impulse[:2], 0, atol=1e-9 * impulse[2])
    twist = end["angular_momentum"][0] - start["angular_momentum"][0]
    x, y = -twist[1] / impulse[2], twist[0] / impulse[2]
    lever = np.array([y, -x, 0])
    # The orientation at the impact lies between both, which differ little.
    body = Rotation.from_quat(start["orientation"][0], scalar_first=True)
    ease = 1 / mass + (body.apply(lever, inverse=True) ** 2 / (mass * shape.moments())).sum()
    approach = -before[2] - np.cross(start["spin"][0], [x, y, 0])[2]
    assert impulse[2] * ease / approach == pytest.approx(1 + USUAL["restitution"], rel=1.5e-3)
    assert ease > 1.05 / mass


@pytest.mark.slow
def test_a_rod_hits_another_head_on_with_the_restitution_of_the_material():
    """End to end and across, at the centres, where nothing turns."""
    for turn, apart in ((LYING, 5 * D), ((1.0, 0, 0, 0), D)):
        place = [(-0.51 * apart, 0, 0), (0.51 * apart, 0, 0)]
        made = moving(
            ROD, place, (LAW, WEIGHTLESS), 1e-7, 15_000, velocity=[(0.2, 0, 0), (-0.2, 0, 0)],
            orientation=[turn, turn], materials=material(),
        )  # fmt: skip
        (result,) = simulate([made])
        np.testing.assert_allclose(result.state["velocity"][:, 0], [-0.14, 0.14], rtol=0.01)
        np.testing.assert_allclose(result.state["spin"], 0, atol=1e-6)


@pytest.mark.slow
def test_rods_of_length_0_are_spheres():
    """They hit each other and the floor, spinning, with friction; the difference is of first order in dt."""
    velocity, spin = [(0.3, 0, -0.4), (-0.2, 0, -0.1)], [(10.0, 200.0, -30.0)] * 2
    place, errors = [(0, 0, 1.05e-3), (1.98e-3, 1e-4, 1.2e-3)], []
    effects = LAW, WEIGHT, FLOOR
    for dt, steps in ((2e-6, 5000), (1e-6, 10_000)):
        more = {"materials": material(), "velocity": velocity}
        made = moving(BALL, place, effects, dt, steps, angular_velocity=spin, **more)
        particles = Particles(
            position=place, velocity=velocity, radius=D, density=DENSITY, quantities={"spin": spin}
        )
        spheres = Scene(particles=particles, effects=effects, stepper=fixed(dt), duration=dt * steps,
                        materials=material())  # fmt: skip
        (one,), (other,) = simulate([made]), simulate([spheres])
        assert np.abs(one.state["velocity"] - velocity).max() > 0.3
        errors.append([np.abs(one.state[k] - other.state[k]).max() for k in ("position", "velocity", "spin")])
    assert (np.array(errors[1]) < [1e-7, 1e-5, 1e-2]).all()
    np.testing.assert_allclose(np.log2(np.divide(*errors)), 1.0, atol=0.2)


@pytest.mark.slow
def test_a_rod_falls_and_comes_to_rest_on_both_ends():
    rest = AtRest(energy=1e-9, unbalanced=1e-3, time=0.01)
    lean = Rotation.from_rotvec([0, np.pi / 2 - 0.4, 0]).as_quat(scalar_first=True)
    made = moving(ROD, [(0, 0, 3 * D)], (LAW, WEIGHT, FLOOR, rest), 2e-6, 250_000, orientation=lean,
                  materials=material())  # fmt: skip
    (result,) = simulate([made])
    state, weight = result.state, result.state["mass"][0] * 9.81
    assert result.status.reason.startswith("grains are at rest"), result.status.reason
    assert abs(axis(state)[0, 2]) < 1e-5
    assert result.measures["walls_force_z"] == pytest.approx(-weight, rel=1e-4)
    # Half the weight on each end, by Hertz's law.
    effective = USUAL["young"] / (1 - USUAL["poisson"] ** 2) / 2
    deep = (0.5 * weight / (4 / 3 * effective * np.sqrt(D / 2))) ** (2 / 3)
    assert D / 2 - state["position"][0, 2] == pytest.approx(deep, rel=1e-3)


@pytest.mark.slow
def test_a_brick_comes_to_rest_on_its_largest_face():
    made = moving(BRICK, [(0, 0, 3 * D)], (LAW, WEIGHT, FLOOR), 4e-6, 150_000,
                  orientation=Rotation.from_rotvec([0.3, 0.5, 0.2]).as_quat(scalar_first=True),
                  materials=material())  # fmt: skip
    (result,) = simulate([made])
    state, weight = result.state, result.state["mass"][0] * 9.81
    assert result.status.ok, result.status.reason
    assert abs(axis(state, 1)[0, 2]) > 1 - 1e-5
    assert result.measures["walls_force_z"] == pytest.approx(-weight, rel=1e-2)
    assert state["position"][0, 2] == pytest.approx(BRICK.semi_axes[1], rel=2e-3)


@pytest.mark.slow
def test_a_rod_bounces_as_a_clump_of_spheres_of_the_same_body():
    """17 spheres along a rod, with its mass and inertia. While an end touches the floor, both have the same
    contact. There is no damping, because rods and clumps define its mass differently."""
    law = Granular(normal=HertzMaterial(), tangential=MindlinForce())
    lean = Rotation.from_rotvec([0.3, 0.9, 0]).as_quat(scalar_first=True)
    given = {"velocity": (0.2, 0, -0.5), "orientation": lean, "angular_velocity": (20, 10, -40)}
    made = moving(ROD, [(0, 0, 2.3 * D)], (law, WEIGHT, FLOOR), 1e-6, 12_000, materials=material(), **given)
    mass, along = made.particles.mass[0], np.linspace(-2 * D, 2 * D, 17)
    clump = Clump(centres=[(0, 0, z) for z in along], radii=[D / 2], mass=mass,
                  inertia=np.diag(mass * ROD.moments()))  # fmt: skip
    particles = Particles.of_clumps(clump, [(0, 0, 2.3 * D)], **given)
    beside = made.model_copy(update={"particles": particles, "effects": (RigidClumps(), *made.effects[1:])})
    (rod,), (spheres,) = simulate([made]), simulate([beside])
    body, state = clump_bodies(spheres.state), rod.state
    assert rod.status.ok
    assert spheres.status.ok
    assert state["velocity"][0, 2] > 0
    assert np.linalg.norm(state["spin"][0] - given["angular_velocity"]) > 100
    np.testing.assert_allclose(body.position, state["position"], rtol=0, atol=1e-5 * D)
    np.testing.assert_allclose(body.velocity, state["velocity"], rtol=0, atol=1e-5 * 0.5)
    np.testing.assert_allclose(body.angular_velocity, state["spin"], rtol=0, atol=1e-5 * 300)


def heap(shape, number=3, seed=1, steps=3000, dt=2e-6, walls=(FLOOR,), **more):
    """Bodies that fall on a floor on top of each other."""
    rng = np.random.default_rng(seed)
    apart = 1.6 * shape.bounding_radius()
    place = np.stack(np.meshgrid(*[np.arange(number)] * 3, indexing="ij"), -1).reshape(-1, 3) * apart
    place = place + rng.normal(size=place.shape) * 0.02 * apart + [0, 0, apart]
    turns = Rotation.random(len(place), rng=rng).as_quat(scalar_first=True)
    effects = (LAW, WEIGHT, *walls)
    given = {"velocity": rng.normal(size=place.shape) * 0.2, "materials": material(), **more}
    given["orientation"] = turns
    return moving(shape, place, effects, dt, steps, **given)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rods", "bricks"])
def test_runs_have_the_same_bits_by_any_schedule_in_a_batch_and_restarted(name, tmp_path):
    made = heap(SHAPES[name], steps=2000)
    (whole,) = simulate([made], 2, schedule="world")
    assert whole.status.ok, whole.status.reason
    (other,) = simulate([made], 2, schedule="particle")
    _, batched = simulate([heap(SHAPES[name], seed=2, steps=2000), made], 2, schedule="world")
    half = compiled(made, 2, schedule="world")
    half.load([made])
    half.run(steps=900)
    half.checkpoint(tmp_path / "half.h5")
    half.load([made])
    half.restore(tmp_path / "half.h5")
    half.run()
    assert np.abs(whole.state["spin"]).max() > 50
    for again in (other, batched, half.results()[0]):
        for field, values in whole.state.items():
            np.testing.assert_array_equal(again.state[field], values, err_msg=field)


@pytest.mark.slow
def test_bodies_collide_across_the_faces_of_a_box():
    box = Box(low=(0, 0, 0), high=(0.02, 0.02, 0.02))
    ends = []
    for shift in (0.01, 0.0):
        made = colliding(ROD, LAW, time=3e-3, domain=box)
        place = made.particles.position + shift
        moved = made.particles.model_copy(update={"position": place % 0.02})
        (result,) = simulate([made.model_copy(update={"particles": moved})])
        ends.append(by_id(result))
    inside, across = ends
    assert np.abs(across["position"][:, 0]).max() > 0.015
    np.testing.assert_allclose(across["velocity"], inside["velocity"], rtol=0, atol=1e-10)
    np.testing.assert_allclose((across["position"] + 0.01) % 0.02, inside["position"], rtol=0, atol=1e-13)


def test_a_fixed_rod_does_not_move_and_holds_another():
    """A short rod lies across two fixed ones."""
    turns = [Rotation.from_rotvec([np.pi / 2, 0, 0]).as_quat(scalar_first=True)] * 2 + [LYING]
    made = moving(
        ROD, [(-D, 0, 0), (D, 0, 0), (0, 0, 1.01 * D)], (LAW, WEIGHT), 2e-6, 50_000,
        orientation=turns, quantities={"fixed": [1, 1, 0]}, materials=material(),
    )  # fmt: skip
    (result,) = simulate([made])
    state = by_id(result)
    assert result.status.ok, result.status.reason
    np.testing.assert_array_equal(state["position"][:2], made.particles.position[:2])
    np.testing.assert_array_equal(state["orientation"][:2], result.start["orientation"][:2])
    assert 0.99 * D < state["position"][2, 2] < D
    assert abs(axis(state)[2, 2]) < 1e-3
    assert np.abs(state["velocity"][2]).max() < 1e-4


def test_the_mass_and_the_orientation_of_a_start_are_those_asked_for():
    made = Particles.of_shapes((ROD, BALL), np.eye(3), DENSITY, shape=[0, 1, 0], size=[1, 2, 3])
    volumes = np.array([ROD.volume(), BALL.volume() * 8, ROD.volume() * 27])
    np.testing.assert_allclose(made.mass, DENSITY * volumes, rtol=1e-14)
    np.testing.assert_allclose(made.radius, [2.5 * D, 2 * D, 7.5 * D], rtol=1e-14)
    scene = moving((ROD, BALL), np.eye(3), shape=[0, 1, 0], size=[1, 2, 3], angular_velocity=(0, 0, 7.0))
    turns = scene.start()["orientation"]
    np.testing.assert_allclose(np.linalg.norm(turns, axis=1), 1, rtol=1e-12)
    assert np.linalg.norm(turns[0] - turns[2]) > 0.1
    np.testing.assert_array_equal(scene.start()["orientation"], turns)
    ball = 0.4 * made.mass[1] * made.radius[1] ** 2
    np.testing.assert_allclose(scene.start()["angular_momentum"][1], [0, 0, 7 * ball], rtol=1e-12, atol=1e-22)


RAIN = InsertionByFlux(
    grains=[GrainClass(sizes=EqualSizes(radius=D), density=DENSITY)], number=5, low=(0, 0, 0.05),
    high=(0.02, 0.02, 0.07), flux=1e6,
)  # fmt: skip
REFUSED = {
    "stepper": ({"stepper": Boris(control=FixedStep(dt=1e-6))}, "stepper must be one that follows constr"),
    "another law": (
        {"effects": (Hertz(young=1e7, poisson=0.3),)},
        "effects.hertz must be a law for bodies with shapes, not for spheres, with effects.rigid_rods",
    ),
    "drag": ({"effects": (StokesDrag(viscosity=1.0),)}, "effects.stokes_drag must be a law for bodies"),
    "a disc": (
        {"effects": (LAW, Walls(discs=[Disc(normal=(0, 0, 1), radius=0.1)]))},
        "effects.walls must be made of planes, spheres, and open cylinders and cones, with effects.rigid",
    ),
    "no such shape": ({"shape": 1}, "particles.shape must be indices of the 1 shapes"),
    "prescribed motion": (
        {"effects": (PrescribedMotion(group=1),), "quantities": {"group": [1]}},
        "particles must be held by one of rigid_rods, prescribed_motion; received one held by 2",
    ),
    "insertion": (
        {"effects": (RAIN,)},
        "effects.insertion_by_flux must be without inserted particles, with effects.rigid_rods",
    ),
    "a fixed rod that spins": (
        {"quantities": {"fixed": [1]}, "angular_velocity": (1, 0, 0)},
        "particles.spin must be 0 for fixed particles",
    ),
    "a long quaternion": ({"orientation": (2, 0, 0, 0)}, "particles.orientation must be unit quaternions"),
}


@pytest.mark.parametrize("why", REFUSED)
def test_invalid_scenes_are_refused(why):
    given, message = REFUSED[why]
    with pytest.raises(InputError, match=message):
        simulate([moving(ROD, [(0, 0, 0)], given.pop("effects", ()), materials=material(), **given)])


@pytest.mark.parametrize(("moves", "slower"), [("velocity", 0.45), ("angular_velocity", 0.25)])
def test_a_world_stops_if_bodies_may_pass_through_each_other(moves, slower):
    """If a point of a rod may move by more than its radius in a step, by its velocity or its rotation; along
    three axes, as far as the rotation is concerned."""
    motion, far = {"velocity": 10.0, "angular_velocity": 4000.0}[moves], [(-0.02, 0, 0), (0.02, 0, 0)]

    def reason(value):
        given = {moves: [(value, 0, 0), (-value, 0, 0)], "orientation": (1, 0, 0, 0)}
        (result,) = simulate([moving(ROD, far, (LAW, WEIGHTLESS), 1e-4, 10, materials=material(), **given)])
        return result.status.reason

    message = reason(motion)
    assert "pass through each other: particle 0 moves by 0.001 m relative to the others" in message
    assert "the smallest half extent is 0.0005 m; it must be below 5e-05 s" in message
    assert reason(slower * motion) == "reached its end"


@pytest.mark.slow
def test_steps_are_limited_by_the_mobility_of_the_point_of_contact():
    """Steps must be below 2 sqrt(m*/k), at an end of a rod 0.63 of the limit for its mass."""
    stiffness, lean, law = 1000.0, 0.6, Granular(normal=Hooke())
    turn = Rotation.from_rotvec([0, np.pi / 2 + lean, 0]).as_quat(scalar_first=True)
    height = D / 2 + 2 * D * np.sin(lean) - 1e-3 * D
    mass, across = DENSITY * ROD.volume(), ROD.moments()[0]
    easy = 1 + (2 * D * np.cos(lean)) ** 2 / across
    assert np.sqrt(1 / easy) < 0.64
    reasons = []
    for part in (0.98, 1.02):
        dt = part * 2 * np.sqrt(mass / easy / stiffness)
        given = {"materials": {"grain": Material(stiffness=stiffness)}, "orientation": turn}
        (result,) = simulate([moving(ROD, [(0, 0, height)], (law, FLOOR), dt, 3, **given)])
        reasons.append(result.status.reason)
    assert reasons[0] == "reached its end"
    assert "a step is too long for the springs and dashpots of a contact" in reasons[1]
