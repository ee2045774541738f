"""Contact springs rotate with the touching bodies: closed forms of held grains, bodies that stick."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation as Turn

from tests.effects.contact.grains import heap, reference
from tests.effects.contact.granular_reference import carrying
from tests.effects.contact.loads import close
from tests.scenes import by_id, compiled, scene
from tisim import Clump, Material, Particles, Scene
from tisim.effects import (
    CapillaryBridge,
    Granular,
    Gravity,
    HertzMaterial,
    Hooke,
    LinearSpring,
    MindlinDisplacement,
    MindlinForce,
    PrescribedMotion,
    RestitutionDamping,
    RigidClumps,
    RollingEPSD,
    RollingSDS,
    Rotation,
    Translation,
    TwistingSDS,
    Walls,
)
from tisim.geometry import CylindricalSurface, Disc, Plane
from tisim.steppers import FixedStep, Verlet

pytestmark = pytest.mark.slow

R, YOUNG, POISSON, PRESSED = 1e-3, 1e7, 0.25, 2e-5
"""m, Pa, -, m."""
APART = 3e-8
"""m; distance of the axes of two bodies that rotate as one."""
RATE = 2 * np.pi
"""rad/s."""
E_STAR = YOUNG / 2 / (1 - POISSON**2)
RATIO = 2 * (1 - POISSON) / (2 - POISSON)
"""Mindlin's tangential stiffness over Hertz's."""
SPRINGS = {"mindlin_force": (MindlinForce(), RATIO), "mindlin_displacement": (MindlinDisplacement(), RATIO),
           "linear_spring": (LinearSpring(stiffness_ratio=0.5), 0.5)}  # fmt: skip
ROLLING = {
    "rolling_sds": (RollingSDS(), 50.0),
    "rolling_epsd": (RollingEPSD(damping_ratio=0.0), 2.25 * 0.3**2 * 2 * E_STAR * np.sqrt(R / 2 * PRESSED)),
}
"""N/m."""
SURFACE = {"young": YOUNG, "poisson": POISSON, "friction": 1e3, "restitution": 1.0, "rolling_friction": 0.3,
           "rolling_stiffness": 50.0, "rolling_damping": 0.0}  # fmt: skip
LOOKS = (0.1, 0.25, 0.6, 1.0, 2.0)
"""Times of comparison, in turns."""


def stiffness(radius):
    """Hertz's stiffness at R* (m)."""
    return 2 * E_STAR * np.sqrt(radius * PRESSED)


def held(law, groups, place, walls=(), dt=5e-4):
    """Grains with prescribed motions, one motion for each."""
    motions = [PrescribedMotion(name=f"g{k}", group=k + 1, motion=one) for k, one in enumerate(groups)]
    return scene(
        place, np.zeros((len(place), 3)), (law, *motions, *walls), radius=R, mass=1.0, dt=dt, duration=3.0,
        materials={"grain": Material(**SURFACE)},
        quantities={"group": np.arange(1.0, len(place) + 1)},
    )  # fmt: skip


def seen(made, times):
    """States of a scene at some times."""
    simulation = compiled(made, 1, 8)
    simulation.load([made])
    for time in times:
        simulation.run(until=time)
        (result,) = simulation.results()
        assert result.status.ok or result.status.reason == "running", result.status.reason
        yield by_id(result)


def across(state, n):
    """The tangential force on the first grain, whose contact has the normal n, N."""
    force = state["force"][0]
    return force - (force @ n) * n


AXES = {"normal": (0.0, 0.0, 1.0), "across": (0.6, 0.8, 0.0), "askew": (2 / 3, -1 / 3, 2 / 3)}


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("name", SPRINGS)
def test_a_pair_rotating_as_one_has_the_exact_force(name, axis):
    """About axes that are displaced by c: the force is S_t (c - R c) perpendicular to the normal, where R is
    the rotation of the bodies. It is zero after whole turns, for any motion of the normal."""
    law, ratio = SPRINGS[name]
    way, c = np.array(AXES[axis]), APART * np.array([1.0, 0.5, -0.7])
    place = np.array([[0, 0, 0], [0, 0, 2 * R - PRESSED]])
    motions = [Rotation(rate=tuple(RATE * way), centre=tuple(at)) for at in (0 * c, c)]
    made = held(Granular(normal=HertzMaterial(), tangential=law), motions, place)
    most = ratio * stiffness(R / 2) * APART
    for turns, state in zip(LOOKS, seen(made, LOOKS), strict=True):
        gap = np.diff(state["position"], axis=0)[0]
        n = gap / np.linalg.norm(gap)
        moved = c - Turn.from_rotvec(RATE * turns * way).apply(c)
        expected = ratio * stiffness(R / 2) * (moved - (moved @ n) * n)
        np.testing.assert_allclose(across(state, n), expected, rtol=0, atol=5e-3 * most)


def test_projected_springs_do_not_turn_about_the_normal():
    """As in LAMMPS: 2 pi S_t c after one turn, 4 pi S_t c after two."""
    place, c = np.array([[0, 0, 0], [0, 0, 2 * R - PRESSED]]), np.array([APART, 0, 0])
    motions = [Rotation(rate=(0, 0, RATE), centre=tuple(at)) for at in (0 * c, c)]
    law = Granular(normal=HertzMaterial(), tangential=MindlinForce(), frame="projected")
    for turns, state in zip((1.0, 2.0), seen(held(law, motions, place), (1.0, 2.0)), strict=True):
        most = RATIO * stiffness(R / 2) * APART
        np.testing.assert_allclose(
            state["force"][0] / most, [0, -2 * np.pi * turns, state["force"][0, 2] / most], atol=1e-2
        )


@pytest.mark.parametrize("wall", ["plane", "disc"])
@pytest.mark.parametrize("name", SPRINGS)
def test_a_grain_rotating_with_a_wall_keeps_its_force(name, wall):
    """About its normal, on a table that rotates about an axis beside the grain's."""
    law, ratio = SPRINGS[name]
    c = APART * np.array([1.0, 0.5, 0.0])
    shapes = {"planes": [Plane()]} if wall == "plane" else {"discs": [Disc(radius=1.0)]}
    table = Walls(motion=Rotation(rate=(0, 0, RATE), centre=tuple(c)), **shapes)
    motions = [Rotation(rate=(0, 0, RATE))]
    made = held(
        Granular(normal=HertzMaterial(), tangential=law), motions, np.array([[0, 0, R - PRESSED]]), [table]
    )
    spring = ratio * stiffness(R)
    for turns, state in zip(LOOKS, seen(made, LOOKS), strict=True):
        moved = c - Turn.from_rotvec([0, 0, RATE * turns]).apply(c)
        expected = spring * moved
        np.testing.assert_allclose(
            across(state, np.array([0, 0, -1.0])), expected, rtol=0, atol=1e-3 * spring * APART
        )


def test_a_grain_rotating_with_a_drum_has_no_force():
    """Around the axis of a drum, together with it: the normal rotates, and this causes no force."""
    drum = Walls(cylinders=[CylindricalSurface(start=(0, 0, -0.1), end=(0, 0, 0.1), radius=5 * R)],
                 motion=Rotation(rate=(0, 0, RATE)))  # fmt: skip
    place = np.array([[4 * R + PRESSED, 0, 0]])
    law = Granular(normal=HertzMaterial(), tangential=MindlinForce())
    made = held(law, [Rotation(rate=(0, 0, RATE))], place, [drum])
    for state in seen(made, LOOKS):
        n = state["position"][0] / np.linalg.norm(state["position"][0])
        assert np.linalg.norm(across(state, n)) < 1e-9 * abs(state["force"][0] @ n)


@pytest.mark.parametrize("where", ["pair", "wall"])
@pytest.mark.parametrize("name", ROLLING)
def test_a_rolling_spring_turns_with_both_bodies(name, where):
    """Two bodies spin about axes that are tilted by d: dM/dt = R*^2 k dw + W x M, where W is their mean spin
    about the normal. M is zero after whole turns."""
    law, k = ROLLING[name]
    radius, d = (R / 2, 1e-4) if where == "pair" else (R, 1e-4)
    if name == "rolling_epsd" and where == "wall":
        k *= np.sqrt(2)
    other = Rotation(rate=(RATE * d, 0, RATE), centre=(0, 0, 2 * R - PRESSED))
    place, walls = np.array([[0, 0, 0], [0, 0, 2 * R - PRESSED]]), []
    motions, sign = [Rotation(rate=(0, 0, RATE)), other], 1
    if where == "wall":
        # In the frame of the grain the table is the other body.
        walls = [Walls(planes=[Plane()], motion=Rotation(rate=(0, 0, RATE)))]
        place, motions, sign = np.array([[0, 0, R - PRESSED]]), [other.model_copy(
            update={"centre": (0, 0, R - PRESSED)})], -1  # fmt: skip
    made = held(Granular(normal=HertzMaterial(), rolling=law), motions, place, walls)
    most = radius**2 * k * d
    for turns, state in zip(LOOKS, seen(made, LOOKS), strict=True):
        angle = RATE * turns
        expected = sign * most * np.array([np.sin(angle), 1 - np.cos(angle), 0])
        np.testing.assert_allclose(state["torque"][0], expected, rtol=0, atol=2e-3 * most)


@pytest.mark.parametrize("where", ["pair", "wall"])
def test_the_mean_of_both_spins_turns_a_spring(where):
    """A grain spins about the normal and a wall without spin slides past at v: dT/dt = S_t v + w/2 n x T,
    which is zero again after two turns of the grain. If another grain slides past instead, the normal tilts,
    and the surface of the spinning grain is displaced sideways by w/2 v t: the force is S_t v t, in a
    constant direction."""
    v = 1e-8
    place, walls, radius = np.array([[0, 0, R - PRESSED]]), [Walls(planes=[Plane()])], R
    spinning = Rotation(rate=(0, 0, RATE), centre=(0, 0, R - PRESSED))
    motions = [spinning]
    if where == "pair":
        place, walls, radius = np.array([[0, 0, 0], [0, 0, 2 * R - PRESSED]]), [], R / 2
        motions = [Rotation(rate=(0, 0, RATE)), Translation(velocity=(v, 0, 0))]
    else:
        walls = [Walls(planes=[Plane()], motion=Translation(velocity=(v, 0, 0)))]
    made = held(Granular(normal=HertzMaterial(), tangential=MindlinForce()), motions, place, walls)
    spring = RATIO * stiffness(radius)
    for turns, state in zip(LOOKS, seen(made, LOOKS), strict=True):
        angle = RATE / 2 * turns
        expected = spring * 2 * v / RATE * np.array([np.sin(angle), 1 - np.cos(angle), 0])
        if where == "pair":
            n = np.diff(state["position"], axis=0)[0]
            expected = spring * v * turns * np.array([1, 0, 0])
            state["force"][0] = across(state, n / np.linalg.norm(n))
        force = state["force"][0] * [1, 1, 0]
        np.testing.assert_allclose(force, expected, rtol=0, atol=2e-3 * spring * v / RATE)


def tripod(steps, rate, out, turns):
    """Positions, relative to the table, of a tripod that stands on a rotating table and sticks to it, after
    each turn, m."""
    radius, young, gravity = 5e-3, 1e6, 9.81
    angles = np.array([0, 1, 2]) * 2 * np.pi / 3
    feet = 1.02 * radius * 2 / np.sqrt(3) * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    mass = 2500.0 * 4 / 3 * np.pi * radius**3
    sunk = (mass * gravity / (4 / 3 * young / 2 / (1 - 0.3**2) * np.sqrt(radius))) ** (2 / 3)
    body = Clump(centres=feet, radii=[radius] * 3, density=2500.0)
    made = Scene(
        particles=Particles.of_clumps(body, position=[(out, 0, radius - sunk)], velocity=[(0, rate * out, 0)],
                                      angular_velocity=[(0, 0, rate)]),
        materials={"rock": Material(young=young, poisson=0.3, friction=1.0, restitution=0.3)},
        effects=(
            RigidClumps(),
            Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce()),
            Walls(planes=[Plane()], motion=Rotation(rate=(0, 0, rate))),
            Gravity(acceleration=(0, 0, -gravity)),
        ),
        stepper=Verlet(control=FixedStep(dt=steps)),
        duration=1e3,
    )  # fmt: skip
    places = []
    for k, state in enumerate(seen(made, 2 * np.pi / rate * np.arange(1, turns + 1))):
        time = 2 * np.pi / rate * (k + 1)
        places.append(Turn.from_rotvec([0, 0, -rate * time]).apply(state["clump_position"][0]))
    return np.array(places)


def test_a_body_that_sticks_to_a_turntable_does_not_creep():
    """At 0.31 of Coulomb's limit, a tripod that cannot roll moves by less than 1e-4 of 2 pi T / S_t = 61 um a
    turn, in steps of any size. It would creep by that distance if the springs did not rotate with it."""
    for dt in (2e-5, 1e-5):
        moved = np.diff(tripod(dt, 2 * np.pi / 0.6, 0.028, 4)[1:], axis=0)
        assert np.abs(moved[:, :2]).max() < 6e-9


def test_rotating_a_spring_keeps_its_length():
    """Against a SciPy integral of dT/dt = W x T along a path of the normal with a spin about it; length is
    preserved."""

    def normal(t):
        n = np.array([np.cos(3 * t) * np.sin(1 + t), np.sin(3 * t) * np.sin(1 + t), np.cos(1 + t)])
        return n / np.linalg.norm(n)

    def rate(t, vector):
        n, h = normal(t), 1e-6
        slope = (normal(t + h) - normal(t - h)) / (2 * h)
        return np.cross(np.cross(n, slope) + 5.0 * n, vector)

    start = np.cross(normal(0), [0.3, -0.2, 0.9])
    exact = solve_ivp(rate, (0, 1), start, rtol=1e-10, atol=1e-12).y[:, -1]
    errors = []
    for steps in (100, 200):
        known, dt = start, 1 / steps
        for k in range(steps):
            a, n = normal(k * dt), normal((k + 1) * dt)
            tilt = (a - (a @ n) * n) / (1 + a @ n)
            known = (carrying(n[None], tilt[None], np.array([2.5 * dt])) @ known)[0]
        errors.append(np.linalg.norm(known - exact))
        assert np.linalg.norm(known) == pytest.approx(np.linalg.norm(start), rel=1e-12)
    assert errors[0] < 1e-2
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


def test_projected_springs_equal_the_reference(rng):
    """Grains that stick, slide and spin in a cell."""
    made = heap(rng)
    law, *others = made.effects
    made = made.model_copy(update={"effects": (law.model_copy(update={"frame": "projected"}), *others)})
    known = reference(made)
    known.run(200, 2e-4)
    assert min(known.sliding, known.sticking) > 500
    simulation = compiled(made, 1, 64)
    simulation.load([made])
    simulation.run(steps=200)
    state = by_id(simulation.results()[0])
    for name, values in (("position", known.x), ("velocity", known.v), ("spin", known.w)):
        close(state[name], values, 1e-11)


def test_an_elastic_pair_keeps_its_energy():
    """Two grains joined by a liquid, without dissipation, oscillate in all their springs and rotate like a
    top. For 1e5 steps the error of the total energy stays bounded and is proportional to dt^2."""
    stiff, shear, rolls, twists, tension, dts = 1e4, 0.4, 2e3, 500.0, 50.0, (4e-4, 2e-4, 1e-4)
    pull, spin = 2 * np.pi * tension, np.array([4.0, 0, 1.0])
    place = np.array([[-1, 0, 0], [1, 0, 0]]) * (1 - pull / stiff / 2)
    swing = 0.02 * np.array([[0, 1, 0.3], [0, -1, 0.2]])
    surface = Material(stiffness=stiff, friction=1e3, rolling_friction=1e3, rolling_stiffness=rolls,
                       rolling_damping=0.0, twisting_friction=1e3, twisting_stiffness=twists,
                       twisting_damping=0.0)  # fmt: skip
    law = Granular(normal=Hooke(), tangential=LinearSpring(stiffness_ratio=shear), rolling=RollingSDS(),
                   twisting=TwistingSDS())  # fmt: skip
    wet = CapillaryBridge(surface_tension=tension, contact_angle=0.0, volume=1e-3)

    def energy(state):
        overlap = 2 - np.linalg.norm(np.diff(state["position"], axis=0))
        moving = (state["velocity"] ** 2).sum() + 0.4 * (state["spin"] ** 2).sum()
        known = (state["granular_past"].reshape(-1, law.memory) ** 2).sum(axis=0)
        drawn, rolled, twisted = known[:3].sum(), known[3:6].sum(), known[6]
        held = shear * stiff * drawn + rolls * rolled + twists * twisted + stiff * overlap**2
        return (moving + held) / 2 - pull * overlap

    made = [
        scene(place, np.cross(spin, place) + swing, (law, wet), radius=1.0, mass=1.0, dt=dt, duration=40.0,
              materials={"grain": surface}, quantities={"spin": spin + swing[::-1]})
        for dt in dts
    ]  # fmt: skip
    simulation = compiled(made[0], 4, 8)
    simulation.load(made)
    energies = []
    for until in range(41):
        simulation.run(until=float(until))
        results = simulation.results()
        assert all(one.status.ok or one.status.reason == "running" for one in results)
        energies.append([energy(by_id(one)) for one in results])
    swings = (swing**2).sum() * 0.7
    off = np.abs(np.array(energies) - energies[0]).max(axis=0) / swings
    assert off[0] < 0.05
    assert off[0] / off[2] == pytest.approx(16, rel=0.3)
