"""Groups that are frozen or driven: their motion, the forces on them, and errors."""

import numpy as np
import pytest

import tisim
from tests.scenes import RADIUS, compiled, scene, simulate
from tisim import Box, InputError, Material, Particles, Scene
from tisim.effects import (
    Fixed,
    Granular,
    Gravity,
    HertzMaterial,
    Impact,
    MindlinForce,
    Oscillation,
    PrescribedMotion,
    RestitutionDamping,
    Rotation,
    Servo,
    Translation,
)
from tisim.operators import AtRest
from tisim.steppers import Trapezoid

LAW = Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce())
GRAINS = {"grain": Material(young=1e7, poisson=0.3, restitution=0.7, friction=0.5)}
G = 9.81


def driven(motion, place, velocity=None, group=(1,), effects=(), **more):
    """Particles of the given groups; group 1 moves as prescribed."""
    velocity = np.zeros_like(np.asarray(place, float)) if velocity is None else velocity
    acting = (PrescribedMotion(name="plate", motion=motion), *effects)
    return scene(place, velocity, acting, quantities={"group": list(group)}, **more)


@pytest.mark.parametrize(
    "motion",
    [
        "rotation",
        *(pytest.param(name, marks=pytest.mark.long) for name in ("oscillation", "translation")),
        *(pytest.param(f"translation {when}", marks=pytest.mark.long) for when in ("later", "after")),
    ],
)
def test_a_driven_group_follows_its_motion(motion):
    """For any gravity and any initial velocity; also through the faces of a box."""
    rate, centre, amplitude = np.array([0.3, -2.0, 1.0]), np.array([1e-2, 0, 0]), np.array([1e-3, 2e-3, 0])
    going = (0.5, -0.1, 0.2)
    kinds = {
        "oscillation": Oscillation(amplitude=tuple(amplitude), frequency=40, phase=0.5),
        "rotation": Rotation(rate=tuple(rate), centre=tuple(centre)),
        "translation": Translation(velocity=going),
        "translation later": Translation(velocity=going, begin=0.0123),
        "translation after": Translation(velocity=going, begin=1.0),
    }
    place = np.array([[0.0, 0.0, 0.0], [3e-3, 1e-3, 0.0], [0.0, 9e-3, 0.0]])
    box = Box(low=(-0.01,) * 3, high=(0.01,) * 3)
    fall = (Gravity(acceleration=(0, 0, -G)),)
    made = driven(kinds[motion], place, np.ones((3, 3)), (1, 1, 0), fall, dt=1e-4, steps=300, domain=box)
    (result,) = simulate([made], capacity=3)
    t, state = result.time, result.state
    if motion == "oscillation":
        turn = 2 * np.pi * 40
        path = place + amplitude * (np.sin(turn * t + 0.5) - np.sin(0.5))
        velocity, spin = np.tile(amplitude * turn * np.cos(turn * t + 0.5), (3, 1)), np.zeros(3)
    elif motion == "rotation":
        size = np.linalg.norm(rate)
        axis, arm, angle = rate / size, place - centre, size * t
        along = np.outer(arm @ axis, axis)
        path = centre + along + np.cos(angle) * (arm - along) + np.sin(angle) * np.cross(axis, arm)
        velocity, spin = np.cross(rate, path - centre), rate
    else:
        moving = max(t - kinds[motion].begin, 0.0)
        path, spin = place + np.array(going) * moving, np.zeros(3)
        velocity = np.tile(going if moving > 0 else (0.0, 0.0, 0.0), (3, 1))
    apart = (state["position"] - path + 0.01) % 0.02 - 0.01
    np.testing.assert_allclose(apart[:2], 0, rtol=0, atol=1e-16)
    np.testing.assert_allclose(state["velocity"][:2], velocity[:2], rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(state["spin"][:2], [spin, spin])
    fallen = place[2] + t - [0, 0, G * t**2 / 2]
    np.testing.assert_allclose((state["position"][2] - fallen + 0.01) % 0.02 - 0.01, 0, rtol=0, atol=1e-12)


BASE = np.array([[x, y, 0.0] for x in range(3) for y in range(3)]) * 1.9 * RADIUS
"""m; nine grains that overlap each other, as in a rough plate."""
SEAT = np.array([0.95, 0.95, 0.0]) * RADIUS * 2 - [0.95 * RADIUS, 0.95 * RADIUS, 0]


def on_plate(height, velocity=(0.0, 0.0, 0.0), motion=None, over=SEAT, **more):
    """A grain above a plate of grains, over the hollow between four; it comes to rest."""
    place = np.vstack([BASE, over])
    place[-1, 2] = height
    going = np.zeros((10, 3))
    going[-1] = velocity
    fall = (LAW, Gravity(acceleration=more.pop("gravity", (0, 0, -G))), AtRest(time=1e-3, unbalanced=1e-7))
    given = {"dt": 2e-6, "materials": GRAINS, **more}
    return driven(motion or Fixed(), place, going, [1] * 9 + [0], fall, **given)


@pytest.mark.slow
def test_a_frozen_group_carries_the_weight_on_it():
    height = np.sqrt(4 - 2 * 0.95**2) * RADIUS
    (result,) = simulate([on_plate(height * (1 - 1e-3), steps=1_000_000)], capacity=10)
    assert result.status.reason == "grains are at rest, by effects.at_rest"
    state, weight = result.state, result.start["mass"][0] * G
    np.testing.assert_array_equal(state["position"][:9], BASE)
    np.testing.assert_array_equal(state["velocity"][:9], 0)
    assert np.linalg.norm(state["velocity"][9]) < 1e-7
    force = [result.measures[f"plate_force_{axis}"] for axis in "xyz"]
    np.testing.assert_allclose(force, [0, 0, -10 * weight], rtol=0, atol=1e-6 * weight)
    torque = [result.measures[f"plate_torque_{axis}"] for axis in "xyz"]
    expected = np.cross([*BASE, SEAT], [0, 0, -weight]).sum(axis=0)
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    # The grains of the plate overlap each other, but only the grain on top exerts a force on them.
    np.testing.assert_allclose(state["force"][[2, 5, 6, 7, 8]], np.tile([0, 0, -weight], (5, 1)), rtol=1e-12)


@pytest.mark.long
def test_a_group_continues_from_an_earlier_run():
    place, fall = (
        np.array([[0.0, 0.0, 0.0], [3e-3, 1e-3, 0.0], [0.0, 9e-3, 0.0]]),
        Gravity(acceleration=(0, 0, -G)),
    )
    made = driven(Translation(velocity=(0.5, -0.1, 0.2)), place, None, (1, 1, 0), (fall,), dt=1e-4, steps=300)
    (first,) = simulate([made], capacity=3)
    core = {name: first.state[name] for name in ("position", "velocity", "radius", "mass")}
    rest = {name: first.state[name] for name in ("group", "spin", "reference_position", "body_mass")}
    rest["body_mass"] = 7.0 * rest["body_mass"]
    again = made.model_copy(update={"particles": Particles(**core, quantities=rest)})
    (second,) = simulate([again], capacity=3)
    moved = second.state["position"][:2] - core["position"][:2]
    np.testing.assert_allclose(moved, np.tile([0.015, -0.003, 0.006], (2, 1)), rtol=1e-9)
    assert second.state["body_mass"][2] == core["mass"][2]


@pytest.mark.slow
def test_a_driven_group_is_as_heavy_as_a_wall():
    """A grain in a head-on impact leaves with e times the approach speed, in the frame of the group."""
    plate, speed, e = np.array([0.0, 0.0, 0.3]), -0.2, GRAINS["grain"].restitution
    hit = on_plate(
        2.001 * RADIUS,
        (0.0, 0.0, speed),
        Translation(velocity=tuple(plate)),
        gravity=(0.0, 0.0, 0.0),
        over=BASE[4],
        dt=1e-6,
        steps=3000,
    )
    (result,) = simulate([hit], capacity=10)
    assert result.state["velocity"][9, 2] == pytest.approx(plate[2] + e * (plate[2] - speed), rel=1e-3)
    np.testing.assert_allclose(result.state["velocity"][:9], [plate] * 9, rtol=0, atol=0)


@pytest.mark.slow
def test_runs_have_the_same_bits_by_any_schedule_and_restarted(tmp_path):
    made = on_plate(1.5 * RADIUS, (0.1, 0.05, -0.3), Translation(velocity=(0.2, 0.0, 0.1)), steps=400)
    (whole,) = simulate([made], capacity=10, schedule="world")
    (other,) = simulate([made], capacity=10, schedule="particle")
    half = compiled(made, 1, 10, "world")
    half.load(made)
    half.run(steps=150)
    half.checkpoint(tmp_path / "half.h5")
    half.load(made)
    half.restore(tmp_path / "half.h5")
    half.run()
    assert np.abs(whole.state["velocity"][9] - [0.1, 0.05, -0.3]).max() > 0.01
    for again in (other, half.results()[0]):
        for name, values in whole.state.items():
            np.testing.assert_array_equal(again.state[name], values, err_msg=name)


GRAIN = [[0.0, 0.0, 0.0], [3e-3, 0.0, 0.0]]
REFUSED = {
    "no such group": ({"group": (2, 0)}, r"particles.group must be 1 for some particles, as effects.plate"),
    "impacts": ({"effects": (Impact(hardness=1.0),)}, r"effects.plate must be used without impact"),
    "stepper": (
        {"stepper": Trapezoid()},
        r"stepper must be one that follows constraints, such as verlet, with effects.plate",
    ),
    "twice": ({"effects": (PrescribedMotion(name="lid"),)}, r"particles must be held by one of plate, lid"),
    "servo": ({"motion": Servo(force=1.0, limit=1.0)}, r"plate.motion must be one that is known ahead"),
}


@pytest.mark.parametrize("why", REFUSED)
def test_invalid_scenes_are_refused(why):
    wrong, message = REFUSED[why]
    with pytest.raises(InputError, match=message):
        simulate([driven(**{"motion": Fixed(), "place": GRAIN, "group": (1, 0), **wrong})])


def test_a_scene_file_names_group_and_motion():
    made = driven(Rotation(rate=(0, 0, 1.0)), GRAIN, group=(1, 0))
    assert '[effects.plate]\nkind = "prescribed_motion"\n' in made.to_toml()
    assert Scene.from_dict(made.to_dict()) == made


@pytest.mark.slow
def test_held_groups_repel_each_other_as_grains_do():
    """They meet head on, with an overlap of a hundredth of a radius: damping uses the mass of a grain, not of
    a wall."""
    place, speed, dt = [[0, 0, 0], [0, 0, 1.99 * RADIUS]], -1e-3, 1e-7
    forces = []
    for other in (1, 0):
        held = (PrescribedMotion(name="b", group=2, motion=Translation(velocity=(0, 0, speed))),)
        made = driven(
            Fixed(), place, [[0, 0, 0], [0, 0, speed]], (1, 2 * other), (*held[:other], LAW),
            materials=GRAINS, dt=dt, steps=1,
        )  # fmt: skip
        forces.append(tisim.run(made).measures["plate_force_z"])
    stiff = 1e7 / (2 * (1 - 0.3**2))
    hertz = 4 / 3 * stiff * np.sqrt(RADIUS / 2) * (0.01 * RADIUS) ** 1.5
    assert -forces[1] == pytest.approx(hertz, rel=0.1)
    assert forces[0] == pytest.approx(forces[1], rel=0.02)
