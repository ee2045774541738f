"""Walls that translate, rotate, shake and press: grains at them against closed forms, and the
forces on them."""

import numpy as np
import pytest

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.effects.contact.surfaces import AWAY, POISSON, RADIUS, YOUNG, moving
from tests.scenes import by_id, compiled, scene, simulate
from tisim import InputError, Material, MeasureSeries, Recording, Simulation
from tisim.effects import (
    Gravity,
    Oscillation,
    Rotation,
    Servo,
    Translation,
    Walls,
)
from tisim.effects.walls.servo import MOST_RESISTANCE, QUANTA
from tisim.geometry import CylindricalSurface, Plane
from tisim.io.reader import frames

WORLDS, CAPACITY = 8, 4
E_STAR = YOUNG / (2 * (1 - POISSON**2))
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
NOWHERE = Plane(point=(0, 0, -AWAY))
STILL = Oscillation(amplitude=(0, 0, 0), frequency=1)
G = 10.0


def sunk(push):
    """The overlap (m) at which a wall pushes a grain with the force ``push`` (N)."""
    return (3 * push / (4 * E_STAR * RADIUS**0.5)) ** (2 / 3)


def among(position, velocity, floor=NOWHERE, drum=None, lid=None, law=None, more_walls=(), **more):
    """Grains of 1 kg among walls at rest and in motion, each given as (shape, motion); walls that are not
    given are far away. ``more_walls`` makes another structure, which takes long to compile."""
    law = {"young": YOUNG, "poisson": POISSON, "restitution": 0.5, "friction": 0.5, **(law or {})}
    tube = CylindricalSurface(start=(AWAY, -1, 0), end=(AWAY, 1, 0), radius=1)
    tube, turning = drum or (tube, Rotation(rate=(0, 1, 0)))
    cover, pressing = lid or (Plane(point=(0, 0, AWAY), normal=DOWN), Servo(force=1, limit=1))
    acting = (
        HERTZ_MINDLIN,
        Walls(name="floor", planes=[floor]),
        Walls(name="drum", cylinders=[tube], motion=turning),
        Walls(name="lid", planes=[cover], motion=pressing),
        *more_walls,
        Gravity(acceleration=more.pop("gravity", (0.0, 0.0, -G))),
    )
    spin = more.pop("spin", np.zeros_like(np.asarray(position, float)))
    given = {"radius": RADIUS, "mass": 1.0, "dt": 2e-5, "quantities": {"spin": spin}, **more}
    given["materials"] = {"grain": Material(**law)}
    return scene(position, velocity, acting, **given)


def shaken(plate=NOWHERE, shaking=STILL, band=NOWHERE, going=(0.0, 0.0, 0.0)):
    """A plate that shakes, and a wall that moves at constant velocity."""
    return (
        Walls(name="shaker", planes=[plate], motion=shaking),
        Walls(name="belt", planes=[band], motion=Translation(velocity=going)),
    )


def run(scenes, **more):
    results = simulate(scenes, worlds=WORLDS, capacity=CAPACITY, **more)
    for result in results:
        assert result.status.ok, result.status.reason
    return results


@pytest.mark.slow
def test_moving_walls_are_galilean_invariant():
    """A spinning grain hits a wall that translates: the motion is the same as in the frame of the wall."""
    goes, velocity, spin = np.array([0.7, -0.4, 1.1]), np.array([0.3, 0.2, -1.0]), [[3.0, -5.0, 20.0]]
    place, more = [[0, 0, RADIUS + 0.05]], {"spin": spin, "steps": 20_000}
    walls = shaken(), shaken(band=Plane(), going=tuple(goes))
    rests = among(place, [velocity], floor=Plane(), more_walls=walls[0], **more)
    rest, moved = run([rests, among(place, [velocity + goes], more_walls=walls[1], **more)])
    shift = goes * rest.time
    np.testing.assert_allclose(moved.state["position"] - shift, rest.state["position"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(moved.state["velocity"] - goes, rest.state["velocity"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(moved.state["spin"], rest.state["spin"], rtol=0, atol=1e-7)
    assert np.linalg.norm(rest.state["velocity"] - velocity) > 0.5


@pytest.mark.slow
def test_a_turning_drum_drags_a_grain_with_mu_times_its_weight():
    """While it slides: v = mu g t along the wall, and a torque of mu m g R on the drum."""
    friction, size, t = 0.3, 2.0, 0.05
    drum = CylindricalSurface(start=(0, -1, 0), end=(0, 1, 0), radius=size)
    place = [[0, 0, -size + RADIUS - sunk(G)]]
    turning = Rotation(rate=(0, 2.0, 0))
    law = {"friction": friction}
    slides, rolls = run(
        [among(place, [[0, 0, 0]], drum=(drum, turning), law=law, duration=end) for end in (t, 3.0)]
    )
    speed, spin = slides.state["velocity"][0, 0], slides.state["spin"][0, 1]
    # The lowest point of the drum moves at 4 m/s along -x.
    assert speed == pytest.approx(-friction * G * t, rel=0.01)
    assert spin == pytest.approx(2.5 * friction * G * t / RADIUS, rel=0.01)
    assert slides.measures["drum_force_x"] == pytest.approx(friction * G, rel=0.01)
    assert slides.measures["drum_torque_y"] == pytest.approx(-friction * G * size, rel=0.01)
    assert slides.measures["drum_force_z"] == pytest.approx(-G, rel=0.01)
    # Then the grain rolls in the drum, without slip.
    r, v, w = (rolls.state[name][0] for name in ("position", "velocity", "spin"))
    out = r / np.linalg.norm(r)
    slip = np.cross((0, 2.0, 0), size * out) - v - np.cross(w, RADIUS * out)
    assert np.linalg.norm(slip) < 0.02 < np.linalg.norm(v)


@pytest.mark.slow
def test_the_floor_bears_the_weight_of_a_column():
    """Three grains at rest."""
    place = [[0, 0, (2 * k + 0.99) * RADIUS] for k in range(3)]
    (result,) = run([among(place, np.zeros((3, 3)), floor=Plane(), duration=3.0)])
    assert moving(result.state) < 1e-12
    assert result.measures["floor_force_z"] == pytest.approx(-3 * G, rel=1e-6)
    np.testing.assert_allclose(result.state["floor_loads"][:, 2], [3 * G, 0, 0], rtol=1e-6)
    assert result.measures["lid_force_z"] == 0


@pytest.fixture(scope="module")
def pressed():
    """A grain that a servo presses on the floor with 100 N, after it has approached by 0.01 m at 0.1 m/s
    without load."""
    place, gap, speed = [[0, 0, RADIUS - sunk(G)]], 0.01, 0.1
    lid = Plane(point=(0, 0, 2 * RADIUS - sunk(G) + gap), normal=DOWN)
    made = among(place, [[0, 0, 0]], floor=Plane(), lid=(lid, Servo(force=100.0, limit=speed)), duration=0.6)
    return made, gap, speed


@pytest.mark.long
@pytest.mark.slow
def test_a_servo_presses_with_the_wanted_force(pressed, tmp_path):
    made, gap, speed = pressed
    simulation = compiled(made, WORLDS, CAPACITY)
    simulation.load([made])
    series = MeasureSeries(0.1)
    with Recording(tmp_path / "t.h5", frames=6).observer(simulation) as recorder:
        observers = [series, recorder]
        simulation.run(until=0.5 * gap / speed, observers=observers)
        (free,) = simulation.results()
        simulation.run(observers=observers)
    assert free.measures["lid_travel"] == pytest.approx(speed * free.time, rel=1e-9)
    assert free.measures["lid_speed"] == speed
    (result,) = simulation.results()
    assert result.measures["lid_force_z"] == pytest.approx(100.0, rel=1e-5)
    assert result.measures["floor_force_z"] == pytest.approx(-100.0 - G, rel=1e-5)
    deeper = sunk(100.0) + sunk(100.0 + G) - sunk(G)
    assert result.measures["lid_travel"] == pytest.approx(gap + deeper, rel=1e-5)
    # In the series the floor carries only the weight while the lid approaches, then also the servo's force.
    with frames(tmp_path / "t.h5") as recorded:
        for name, values in recorded.measures.items():
            np.testing.assert_array_equal(values, series[0][name], err_msg=name)
            assert values[-1] == result.measures[name]
        assert recorded.measures.keys() == result.measures.keys()
        assert recorded.measures["lid_force_z"][0] == 0
        assert recorded.measures["floor_force_z"][0] == pytest.approx(-G, rel=1e-9)
        np.testing.assert_allclose(recorded.measures["floor_force_z"][3:], -100.0 - G, rtol=1e-3)


@pytest.mark.slow
def test_a_servo_continues_from_a_checkpoint_bit_for_bit(pressed, tmp_path):
    """Also beside other worlds."""
    made, *_ = pressed
    others = among([[0, 0, 1]], [[0, 0, 0]], floor=Plane(), duration=0.3)
    simulation = compiled(made, WORLDS, CAPACITY)
    simulation.load([made])
    simulation.run()
    (alone,) = simulation.results()
    simulation.load([others, made])
    simulation.run(steps=5555)
    simulation.checkpoint(tmp_path / "half.h5")
    simulation.run(steps=999)
    simulation.load([others, made])
    simulation.restore(tmp_path / "half.h5")
    simulation.run()
    restarted = simulation.results()[1]
    assert restarted.measures == alone.measures
    for name, values in by_id(alone).items():
        np.testing.assert_array_equal(by_id(restarted)[name], values, err_msg=name)


@pytest.mark.slow
def test_the_same_bits_on_both_schedules(pressed):
    made, *_ = pressed
    (world,) = run([made])
    simulation = Simulation(made, 1, CAPACITY, schedule="particle")
    simulation.load([made])
    simulation.run()
    (particle,) = simulation.results()
    simulation.close()
    assert particle.measures == world.measures
    for name, values in world.state.items():
        np.testing.assert_array_equal(particle.state[name], values, err_msg=name)


@pytest.mark.slow
def test_a_grain_follows_a_gently_shaking_plate():
    """With an acceleration amplitude of g/2: the plate carries m (g + a), and the grain has the plate's
    velocity, corrected for the overlap, which changes with the force."""
    frequency = 5.0
    omega = 2 * np.pi * frequency
    size = 0.5 * G / omega**2
    shaking = Oscillation(amplitude=(0, 0, size), frequency=frequency, phase=-np.pi / 2)
    place = [[0, 0, RADIUS - sunk(1.5 * G) - size]]
    ends = [
        among(place, [[0, 0, 0]], more_walls=shaken(Plane(), shaking), duration=t) for t in (0.35, 0.4, 0.45)
    ]
    for result in run(ends):
        angle = omega * result.time - np.pi / 2
        rise = -(omega**2) * size * np.sin(angle)
        assert result.measures["shaker_force_z"] == pytest.approx(-(G + rise), rel=0.01)
        speed = omega * size * np.cos(angle)
        speed *= 1 + 2 / 3 * omega**2 * sunk(G + rise) / (G + rise)
        assert result.state["velocity"][0, 2] == pytest.approx(speed, abs=2e-3 * omega * size)


@pytest.mark.slow
def test_a_wall_as_fast_as_sound_throws_grains_ahead():
    """At the sound speed of a chain with an overlap of a thousandth of a radius: four grains at rest fly off
    in order. None is slower than the wall; none is faster than twice its speed, except for focusing in the
    chain."""
    contact = 2 * E_STAR * (0.5 * RADIUS * 1e-3 * RADIUS) ** 0.5
    fast = 2 * RADIUS * contact**0.5
    place = [[2.001 * RADIUS * (k + 1), 0, 0] for k in range(4)]
    wall = Plane(point=(-0.5 * RADIUS, 0, 0), normal=(1, 0, 0))
    made = among(
        place,
        np.zeros((4, 3)),
        more_walls=shaken(band=wall, going=(fast, 0, 0)),
        law={"restitution": 1.0, "friction": 0.0},
        gravity=(0, 0, 0),
        dt=2e-6,
        steps=100_000,
    )
    (result,) = run([made])
    v = result.state["velocity"][:, 0]
    assert (np.diff(v) > -1e-9 * fast).all()
    assert fast < v.min() <= v.max() < 3 * fast
    np.testing.assert_array_equal(result.state["velocity"][:, 1:], 0)


def test_the_sum_of_a_servo_does_not_overflow():
    """Four million grains, each at the largest value that is counted, as for a tiny target force."""
    assert 2**22 * QUANTA * MOST_RESISTANCE < 2**63


def test_invalid_values_are_refused():
    for message, wrong in {
        "servo.direction must be a direction; received (0.0, 0.0, 0.0)": {"direction": (0, 0, 0)},
        "servo.force must be greater than 0.0; received 0": {"force": 0},
    }.items():
        with pytest.raises(InputError) as fault:
            Servo(**{"force": 1.0, "limit": 1.0, **wrong})
        assert str(fault.value) == message
