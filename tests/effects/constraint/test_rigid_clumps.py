"""Rigid clumps: tops, pendulums and dumbbells that hit a floor, against NumPy references and closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation as Turn

from tests.scenes import compiled, fixed, simulate
from tisim import Box, Clump, GrainClass, InputError, Material, Particles, Scene
from tisim.analysis import clump_bodies
from tisim.domains.domain import Open
from tisim.effects import (
    DMT,
    Granular,
    Gravity,
    HertzMaterial,
    Hooke,
    Impact,
    MindlinForce,
    RestitutionDamping,
    RigidClumps,
    StokesDrag,
    Tether,
    Walls,
)
from tisim.effects.constraint.clump_fields import check_clumps, longest_clump
from tisim.geometry import Plane
from tisim.operators import InsertionByFlux
from tisim.packing import EqualSizes
from tisim.steppers import Boris

R = 1e-3
PEAR = Clump(
    centres=np.array([(0, 0, 0), (1.6, 0, 0), (0.5, 1.3, 0), (0, 0, 0.9)]) * R,
    radii=np.array([1, 0.8, 0.7, 0.5]) * R,
    density=2500.0,
)
DUMBBELL = Clump(centres=[(-R, 0, 0), (R, 0, 0)], radii=[R], density=2500.0)
BALL = Clump(centres=[(0, 0, 0)], radii=[R], density=2500.0)


def clumps(shape, place, effects=(), dt=1e-5, steps=1, **more):
    """A scene of clumps."""
    names = ("velocity", "orientation", "angular_velocity", "spheres", "box", "quantities")
    given = {name: more.pop(name) for name in names if name in more}
    return Scene(
        particles=Particles.of_clumps(shape, place, **given),
        effects=(RigidClumps(), *effects),
        stepper=more.pop("stepper", fixed(dt)),
        duration=dt * steps,
        **more,
    )


def reference(scene, stiffness, times, acceleration=0.0):
    """One clump on springs from its members to their initial positions, in NumPy: position, velocity,
    quaternion and angular momentum at some times."""
    start = scene.start()
    body = clump_bodies(start)
    offset, mass, inertia = start["clump_offset"], body.mass[0], body.inertia[0]

    def rate(_t, y):
        q = y[6:10] / np.linalg.norm(y[6:10])
        turn = Turn.from_quat(np.roll(q, -1))
        arm = turn.apply(offset)
        force = -stiffness * (y[:3] + arm - start["position"])
        spin = turn.apply(turn.inv().apply(y[10:]) / inertia)
        w, u = q[0], q[1:]
        turning = 0.5 * np.array([-spin @ u, *(w * spin + np.cross(spin, u))])
        pull = force.sum(axis=0) / mass + acceleration
        return np.concatenate([y[3:6], pull, turning, np.cross(arm, force).sum(axis=0)])

    y = np.concatenate([body.position[0], body.velocity[0], body.orientation[0], body.angular_momentum[0]])
    return solve_ivp(rate, (0, times[-1]), y, "DOP853", times, rtol=1e-12, atol=1e-14 * np.abs(y).max()).y.T


TOPS = 30
"""Worlds of one top each; all tests of tops share a simulation."""


def spun(dt, steps, spin=(100.0, 500.0, -300.0), effects=()):
    return clumps(
        PEAR, [(0, 0, 0)], effects, dt, steps, velocity=(0.1, 0.2, 0.3), angular_velocity=spin, name="top"
    )


def turned_apart(q, p):
    """The angle (rad) between two orientations, for small angles."""
    return 2 * np.linalg.norm(np.cross(q[1:], p[1:]) + p[0] * q[1:] - q[0] * p[1:])


def test_a_free_top_turns_to_second_order_and_keeps_its_momentum():
    errors, energies, time = [], [], 0.02
    (expected,) = reference(spun(1e-4, 200), 0.0, [time])
    for steps in (100, 200, 400):
        made = spun(time / steps, steps)
        (result,) = simulate([made], worlds=TOPS, capacity=4)
        start, end = clump_bodies(result.start), clump_bodies(result.state)
        np.testing.assert_array_equal(end.angular_momentum, start.angular_momentum)
        np.testing.assert_allclose(end.position, start.velocity * time, rtol=1e-13)
        assert np.linalg.norm(end.orientation) == pytest.approx(1, abs=1e-15)
        errors.append(turned_apart(end.orientation[0], expected[6:10]))
        energies.append(abs(end.energy[0] / start.energy[0] - 1))
        arms = Turn.from_quat(np.roll(end.orientation[0], -1)).apply(result.state["clump_offset"])
        state = result.state
        np.testing.assert_allclose(state["position"], end.position + arms, rtol=0, atol=1e-17)
        spin = end.angular_velocity
        np.testing.assert_allclose(state["spin"], np.tile(spin, (4, 1)), rtol=1e-12)
        np.testing.assert_allclose(state["velocity"], end.velocity + np.cross(spin, arms), rtol=1e-12)
    assert errors[0] < 0.01
    orders = np.log2(np.array(errors)[:-1] / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.05)
    assert energies[2] < 1e-5
    assert np.log2(energies[0] / energies[2]) > 3.5


@pytest.mark.long
def test_a_top_spun_about_its_intermediate_axis_flips():
    """Energy stays bounded over thousands of turns, and the axis flips back and forth (Dzhanibekov)."""
    axes = PEAR.body.axes
    spin = axes @ np.array([1.0, 500.0, 1.0])
    made = spun(2e-5, 20_000, tuple(spin))
    simulation = compiled(made, TOPS, 4)
    simulation.load(made)
    along, energy = [], []
    for _ in range(100):
        simulation.run(steps=200)
        body = clump_bodies(simulation.results()[0].state)
        turn = Turn.from_quat(np.roll(body.orientation[0], -1))
        along.append(turn.inv().apply(body.angular_velocity[0])[1] / 500)
        energy.append(body.energy[0])
    assert min(along) < -0.99
    assert max(along) > 0.99
    assert np.ptp(energy) < 2e-5 * np.mean(energy)
    times = np.linspace(0, 0.4, 101)[1:]
    expected = reference(made, 0.0, times)
    turns = Turn.from_quat(np.roll(expected[:, 6:10], -1, axis=1)).inv().apply(expected[:, 10:])
    np.testing.assert_allclose(along, turns[:, 1] / PEAR.body.moments[1] / 500, atol=0.02)


def random_clump(rng):
    """Some spheres, each near the one before; repeated until the clump is accepted."""
    while True:
        number = rng.integers(2, 5)
        steps = rng.normal(size=(number, 3))
        steps *= R * rng.uniform(0.6, 1.5, (number, 1)) / np.linalg.norm(steps, axis=1)[:, None]
        try:
            return Clump(centres=steps.cumsum(axis=0), radii=R * rng.uniform(0.5, 1, number), density=2500.0)
        except InputError:
            continue


@pytest.mark.long
def test_the_energy_of_a_free_top_is_bounded_as_documented(rng, capsys):
    """Tops of any inertia, spun about any axis, at 0.03 rad a step: docs/bodies.md states the errors."""
    spins = rng.normal(size=(TOPS, 3))
    spins *= 500 / np.linalg.norm(spins, axis=1)[:, None]
    shapes = [random_clump(rng) for _ in spins]
    scenes = [
        clumps(shape, [(0, 0, 0)], (), 0.03 / 500, 3000, angular_velocity=tuple(spin), name="top")
        for shape, spin in zip(shapes, spins, strict=True)
    ]
    simulation = compiled(scenes[0], TOPS, 4)
    simulation.load(scenes)
    energies = [[clump_bodies(scene.start()).energy[0] for scene in scenes]]
    for _ in range(30):
        simulation.run(steps=100)
        energies.append([clump_bodies(result.state).energy[0] for result in simulation.results()])
    errors = np.abs(np.array(energies) / energies[0] - 1)
    largest = errors.max(axis=0)
    with capsys.disabled():
        print(f"\nenergy of free tops: median {np.median(largest):.1e}, largest {largest.max():.1e}")
    assert 2e-5 < np.median(largest) < 5e-5
    assert largest.max() < 1e-4
    # The error does not grow: it is the same in both halves. The run may be less than a period of a single
    # top, such as two spheres that precess by half a radian: two of their principal axes are any of a plane.
    halves = errors[:15].max(axis=0), errors[15:].max(axis=0)
    assert halves[1].max() < 1.1 * halves[0].max()
    assert np.median(halves[1] / halves[0]) < 1.1


@pytest.mark.long
def test_a_clump_on_springs_equals_its_numpy_reference():
    """Forces on the members give the force and torque on the body: convergence is second order."""
    stiffness, time, errors = 0.2, 0.02, []
    springs = (Tether(stiffness=(stiffness,) * 3), Gravity(acceleration=(0, 3, -9.81)))
    (expected,) = reference(spun(1e-4, 1), stiffness, [time], np.array([0, 3, -9.81]))
    for steps in (1000, 2000):
        (result,) = simulate([spun(time / steps, steps, effects=springs)], capacity=4)
        body = clump_bodies(result.state)
        ends = [*body.position[0], *body.velocity[0]]
        error = np.abs(ends - expected[:6]) / np.repeat([R, 0.1], 3)
        errors.append(max(error.max(), turned_apart(body.orientation[0], expected[6:10])))
    assert np.linalg.norm(expected[10:] - clump_bodies(result.start).angular_momentum[0]) > 1e-9
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.long
def test_weight_acts_at_the_centre_of_mass():
    # Springs of zero stiffness, for the same structure as in the test above.
    weight = Tether(stiffness=(0.0,) * 3), Gravity(acceleration=(0, 0, -9.81))
    (result,) = simulate([clumps(PEAR, [(0, 0, 0)], weight, 1e-3, 100)], capacity=4)
    body = clump_bodies(result.state)
    assert np.linalg.norm(body.angular_velocity) * 0.1 < 1e-5
    np.testing.assert_allclose(body.position, [[0, 0, -9.81 * 0.1**2 / 2]], rtol=1e-9, atol=1e-12)


LAW = Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce())
USUAL = {"young": 1e7, "poisson": 0.3, "restitution": 0.6, "friction": 0.4}
WORLDS, CAPACITY = 4, 16


def floored(shape, place, gravity=(0.0, 0.0, 0.0), floor=0.0, law=None, **more):
    """Clumps above a floor; all scenes have one structure, which is compiled once."""
    wall = Walls(planes=[Plane(point=(0, 0, floor), normal=(0, 0, 1))])
    given = {"dt": 1e-6, "materials": {"grain": Material(**{**USUAL, **(law or {})})}, **more}
    return clumps(shape, place, (LAW, wall, Gravity(acceleration=gravity)), **given)


def run(scenes, **more):
    results = simulate(scenes, worlds=WORLDS, capacity=CAPACITY, **more)
    for result in results:
        assert result.status.ok, result.status.reason
    return results


@pytest.mark.slow
def test_a_clump_of_one_is_a_sphere():
    """Two single-sphere clumps that hit each other and the floor, spinning; and the same as
    ordinary spheres."""
    far, spin, place = np.array([0.1, 0, 0]), (10.0, 200.0, -30.0), [(0, 0, 1.05e-3), (1.98e-3, 1e-4, 1.2e-3)]
    velocity = np.array([(0.3, 0, -0.4), (-0.2, 0, -0.1)])
    spheres = Particles(
        position=place + far, velocity=velocity, radius=R, density=2500.0, quantities={"spin": [spin] * 2}
    )
    more = {"velocity": velocity, "angular_velocity": spin, "spheres": spheres, "steps": 10_000}
    (result,) = run([floored(BALL, place, (0, 0, -9.81), **more)])
    state = result.state
    np.testing.assert_allclose(state["position"][:2] + far, state["position"][2:], rtol=0, atol=1e-13)
    np.testing.assert_allclose(state["velocity"][:2], state["velocity"][2:], rtol=0, atol=1e-10)
    np.testing.assert_allclose(state["spin"][:2], state["spin"][2:], rtol=0, atol=1e-7)
    assert np.abs(state["velocity"][:2] - velocity).max() > 0.3


@pytest.mark.slow
def test_a_dumbbell_hits_the_floor_with_the_right_impulse():
    """Without friction and loss, J = 2 v / (1/M + (r x n)^2 / I) at the contact point. Upright and with loss,
    v changes to -e v, because the mass of the contact is the mass of the body."""
    body, speed, lean = DUMBBELL.body, 0.05, 0.6
    stiff = {"young": 1e9, "restitution": 1.0, "friction": 0.0}
    made = [
        floored(
            DUMBBELL,
            [(0, 0, R * (1.001 + np.sin(angle)))],
            velocity=(0, 0, -speed),
            orientation=np.roll(Turn.from_rotvec([0, angle, 0]).as_quat(), 1),
            dt=2e-8,
            steps=10_000,
            law=law,
        )
        for angle, law in ((lean, stiff), (np.pi / 2, {**stiff, "restitution": 0.6}))
    ]
    eccentric, upright = (clump_bodies(result.state) for result in run(made))
    arm = R * np.cos(lean)
    impulse = 2 * speed / (1 / body.mass + arm**2 / body.moments[1])
    assert eccentric.velocity[0, 2] == pytest.approx(-speed + impulse / body.mass, rel=2e-3)
    # With a rotation of +lean about y, the end at +x is below: the upward push turns the body the other way.
    np.testing.assert_allclose(eccentric.angular_velocity[0, 1], -impulse * arm / body.moments[1], rtol=2e-3)
    assert upright.velocity[0, 2] == pytest.approx(0.6 * speed, rel=5e-3)


@pytest.mark.slow
def test_a_sticking_end_is_stable_within_its_lever_limit():
    """The contact guard treats the body as a sphere of its mass and requires steps below 2 sqrt(M/k). With a
    lever arm l, steps must be below that over sqrt(1 + M l^2/I); otherwise a sticking end shakes itself off,
    without a message."""
    body, lean, stiffness, surface_energy = DUMBBELL.body, 0.3, 1000.0, 0.5
    arm = R * np.cos(lean)
    lever = np.sqrt(1 + body.mass * arm**2 / body.moments[1])
    held = 4 * np.pi * surface_energy * R / stiffness
    law = Granular(normal=Hooke(), cohesion=DMT())
    floor = Walls(planes=[Plane(normal=(0, 0, 1))])
    material = Material(stiffness=stiffness, surface_energy=surface_energy)
    scenes = [
        clumps(
            DUMBBELL,
            # Its end at +x is below, and overlaps the floor by a tenth less than at rest.
            [(0, 0, R * (1 + np.sin(lean)) - 0.9 * held)],
            (law, floor),
            orientation=np.roll(Turn.from_rotvec([0, lean, 0]).as_quat(), 1),
            dt=part * 2 * np.sqrt(body.mass / stiffness),
            steps=400,
            materials={"grain": material},
        )
        for part in (0.9 / lever, 1.02 / lever, 1.02)
    ]
    sticks, shakes, stops = simulate(scenes, worlds=4, capacity=8)
    assert sticks.status.ok, sticks.status.reason
    assert shakes.status.ok, shakes.status.reason
    assert "a step is too long" in stops.status.reason
    low, lost = (result.state["position"][:, 2].min() for result in (sticks, shakes))
    assert abs(R - low - held) < 0.15 * held
    assert lost > R
    assert clump_bodies(shakes.state).energy[0] > 50 * stiffness * (0.1 * held) ** 2 / 2


def tumbling(seed=1, steps=3000):
    """Three clumps that run into each other, beside a sphere."""
    rng = np.random.default_rng(seed)
    place = [(0, 0, 0.02), (3.2e-3, 0, 0.02), (0, 3e-3, 0.02)]
    velocity = [(0.5, 0.3, 0), (-0.5, 0, 0.1), (0.1, -0.6, 0)]
    spheres = Particles(
        position=[(2e-3, 3e-3, 0.02)], velocity=[(0, -1, 0)], radius=R, density=2500.0,
        quantities={"spin": [(0, 0, 50.0)]},
    )  # fmt: skip
    return floored(
        [PEAR, DUMBBELL, PEAR],
        place,
        velocity=velocity,
        orientation=np.roll(Turn.random(3, rng).as_quat(), 1, axis=1),
        angular_velocity=100 * rng.normal(size=(3, 3)),
        spheres=spheres,
        steps=steps,
    )


def momenta(state):
    """Momentum and angular momentum of clumps and spheres."""
    body, free = clump_bodies(state), state["clump"] < 0
    mass, r, v = state["mass"][free, None], state["position"][free], state["velocity"][free]
    spin = 0.4 * mass * state["radius"][free, None] ** 2 * state["spin"][free]
    p = body.mass[:, None] * body.velocity
    angular = body.angular_momentum + np.cross(body.position, p)
    whole = angular.sum(axis=0) + (np.cross(r, mass * v) + spin).sum(axis=0)
    return p.sum(axis=0) + (mass * v).sum(axis=0), whole


@pytest.mark.slow
def test_clumps_that_collide_keep_momentum_and_shape():
    (result,) = run([tumbling()])
    start, end = clump_bodies(result.start), clump_bodies(result.state)
    (p, spin), (q, turn) = momenta(result.start), momenta(result.state)
    size = (start.mass[:, None] * np.abs(start.velocity)).sum()
    np.testing.assert_allclose(q, p, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(turn, spin, rtol=0, atol=1e-12 * size * 0.02)
    assert np.abs(end.velocity - start.velocity).max(axis=1).min() > 0.01
    for w in range(3):
        own = result.state["clump"] == w
        before, after = (np.linalg.norm(a[own][:, None] - a[own], axis=2) for a in
                         (result.start["position"], result.state["position"]))  # fmt: skip
        np.testing.assert_allclose(after, before, rtol=0, atol=1e-16)
    np.testing.assert_array_equal(result.state["body_mass"][:4], PEAR.body.mass)


@pytest.mark.slow
def test_runs_have_the_same_bits_by_any_schedule_in_a_batch_and_restarted(tmp_path):
    made = tumbling(2, 1500)
    (whole,) = run([made], schedule="world")
    (other,) = run([made], schedule="particle")
    _, batched = run([tumbling(1, 1500), made], schedule="world")
    half = compiled(made, WORLDS, CAPACITY, "world")
    half.load(made)
    half.run(steps=700)
    half.checkpoint(tmp_path / "half.h5")
    half.load(made)
    half.restore(tmp_path / "half.h5")
    half.run()
    for again in (other, batched, half.results()[0]):
        for name, values in whole.state.items():
            np.testing.assert_array_equal(again.state[name], values, err_msg=name)


@pytest.mark.long
def test_clumps_cross_the_faces_of_a_box():
    """A clump may lie across a face at the start."""
    box, velocity = Box(low=(0, 0, 0), high=(0.01, 0.01, 0.01)), np.array([1.0, -0.73, 0.31])
    made = clumps(
        DUMBBELL, [(1e-4, 5e-3, 5e-3)], dt=1e-4, steps=500, velocity=velocity, angular_velocity=(0, 300, 0),
        box=box, domain=box,
    )  # fmt: skip
    (result,) = simulate([made])
    assert (result.start["position"][:, 0] > 0).all()
    place = clump_bodies(result.state).position[0]
    np.testing.assert_allclose(place, ([1e-4, 5e-3, 5e-3] + velocity * result.time) % 0.01, atol=1e-14)
    assert (result.state["position"] >= 0).all()
    assert (result.state["position"] < 0.01).all()
    apart = np.diff(result.state["position"], axis=0)
    assert np.linalg.norm(apart - 0.01 * np.round(apart / 0.01)) == pytest.approx(2 * R, rel=1e-12)


@pytest.mark.long
def test_spheres_may_be_inserted_beside_clumps():
    rain = InsertionByFlux(
        grains=[GrainClass(sizes=EqualSizes(radius=5e-4), density=2500.0)], number=5, low=(0, 0, 0.05),
        high=(0.02, 0.02, 0.07), flux=1e6,
    )  # fmt: skip
    made = clumps(PEAR, [(0, 0, 0)], (rain, Gravity(acceleration=(0, 0, -9.81))), 1e-4, 100)
    (result,) = simulate([made])
    assert len(result.state["mass"]) == 9
    np.testing.assert_array_equal(result.state["clump"], [0] * 4 + [-1] * 5)
    assert clump_bodies(result.state).position[0, 2] == pytest.approx(-9.81 * 1e-4 / 2, rel=1e-9)


LOOSE = Particles(position=[(0, 0, 0)], velocity=[(0, 0, 0)], radius=R, density=2500.0)
REFUSED = {
    "impacts": ({"effects": (Impact(hardness=1.0),)}, "effects.rigid_clumps must be used without impact"),
    "stepper": (
        {"stepper": Boris(control=fixed(1e-5).control)},
        "stepper must be one that follows constraints",
    ),
}


@pytest.mark.parametrize("why", REFUSED)
def test_invalid_scenes_are_refused(why):
    wrong, message = REFUSED[why]
    with pytest.raises(InputError, match=message):
        clumps(PEAR, [(0, 0, 0)], **wrong)


def test_angular_momenta_beyond_finite_velocities_are_refused():
    """The squares of the velocities overflow for the first, and the velocities for the second."""
    start = clumps(PEAR, [(0, 0, 0)]).start()
    for size, message in (
        (1e155, r"^particles\.velocity must be those of their clumps"),
        (
            1.7e308,
            r"^particles\.clump_angular_momentum must be so small that .* are finite; received 1\.7e\+308",
        ),
    ):
        momentum = start["clump_angular_momentum"].copy()
        momentum[0, 0] = size
        with pytest.raises(InputError, match=message):
            check_clumps({**start, "clump_angular_momentum": momentum}, Open())


@pytest.mark.long
def test_particles_without_clumps_are_refused():
    made = clumps(PEAR, [(0, 0, 0)])
    bare = made.model_copy(update={"particles": LOOSE})
    with pytest.raises(InputError, match=r"particles must be made by Particles\.of_clumps with effects"):
        simulate([bare], worlds=TOPS, capacity=4)
    cut = {name: values[1:] for name, values in made.start().items()}
    core = {name: cut.pop(name) for name in ("position", "velocity", "radius", "mass")}
    part = made.model_copy(update={"particles": Particles(**core, quantities=cut)})
    with pytest.raises(InputError, match="particles must be whole clumps"):
        simulate([part], worlds=TOPS, capacity=4)


def test_a_scene_file_holds_clumps():
    made = clumps(PEAR, [(0, 0, 0), (0.01, 0, 0)], (StokesDrag(viscosity=1e-3),))
    assert Scene.from_dict(made.to_dict()).digest() == made.digest()


def put_in(shape, side):
    """A scene that inserts clumps into a periodic box, which is wide enough for the (empty) start."""
    # The radius of a sphere with the volume of the two spheres of a dumbbell.
    grains = GrainClass(sizes=EqualSizes(radius=2 ** (1 / 3) * R), density=2500.0, clump=shape)
    return Scene(
        particles=Particles(position=np.zeros((0, 3)), velocity=np.zeros((0, 3)), radius=R, density=2500.0),
        effects=(
            RigidClumps(),
            Granular(),
            InsertionByFlux(grains=[grains], flux=10.0, number=4, low=(0, 0, 0), high=(side, side, side)),
        ),
        materials={"glass": Material(young=1e7, poisson=0.25)},
        domain=Box(low=(0, 0, 0), high=(side,) * 3),
        stepper=fixed(1e-6),
        duration=1e-5,
    )


@pytest.mark.parametrize(("side", "fits"), [(0.0759, False), (0.0761, True)])
def test_rods_longer_than_the_box_allows_are_refused(side, fits):
    """The rod is 66 mm long, with spheres of 10 mm."""
    rod = Clump(centres=[(8e-3 * k, 0, 0) for k in range(8)], radii=[5e-3] * 8, density=2500.0)
    box = Box(low=(0, 0, 0), high=(side,) * 3)
    made = Scene(
        particles=Particles.of_clumps(rod, position=[(0.03, 0.03, 0.03)], box=box),
        materials={"glass": Material(young=1e7, poisson=0.25)},
        effects=(RigidClumps(), Granular()),
        domain=box,
        duration=1e-5,
    )
    if fits:
        made.acting()[0].check_start(made.start(), made)
    else:
        with pytest.raises(InputError, match=r"box must be at least 0.076 m wide where it is periodic"):
            made.acting()[0].check_start(made.start(), made)


def test_the_longest_clump_is_found_for_any_order_of_members():
    box = Box(low=(-1, -1, -1), high=(1, 1, 1))
    start = Particles.of_clumps(DUMBBELL, position=[(0, 0, 0), (9 * R, 0, 0)]).arrays(box, 0)
    order = [0, 2, 1, 3]
    assert longest_clump({name: values[order] for name, values in start.items()}) == pytest.approx(4 * R)


def test_all_clumps_may_be_inserted_in_a_periodic_box():
    made = put_in(DUMBBELL, 0.1)
    made.acting()[0].check_start(made.start(), made)


def test_inserted_clumps_must_fit_the_box():
    """The largest inserted clump decides: a dumbbell is 4 R long, and another one needs 2 R."""
    for side, fits in ((6.1 * R, True), (5.9 * R, False)):
        made = put_in(DUMBBELL, side)
        if fits:
            made.acting()[0].check_start(made.start(), made)
        else:
            with pytest.raises(InputError, match=r"box must be at least 0.006 m wide where it is periodic"):
                made.acting()[0].check_start(made.start(), made)
