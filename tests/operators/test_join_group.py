"""Layers of grains that join groups: the grains that join, their motion from then on, and the force on
them."""

import numpy as np
import pytest

from tests.scenes import RADIUS, by_id, roundoff, scene, simulate
from tests.throwaway import Trap
from tisim import InputError, Material, Simulation
from tisim.backend import runtime
from tisim.effects import (
    Granular,
    Gravity,
    HertzMaterial,
    PrescribedMotion,
    Rotation,
    Translation,
)
from tisim.geometry import Plane
from tisim.operators import JoinGroup, MeanForce

G, DT, STEPS, JOINS = 9.81, 1e-3, 100, 0.0305
"""Gravity (m/s^2), step (s), number of steps and joining time (s); grains join at the end of the 31st
step."""
SPEED, RATE = (0.1, 0.0, 0.0), (0.0, 0.0, 2.0)
PLACE = np.array([[0.0, 0, -0.2], [0.3, 0, 0.2], [0.0, 0, 0.004], [0.0, 0.2, 0.7], [0.1, 0, 0.6]])
"""Positions (m). At the joining time the third grain has fallen below 0 and the fourth is above the upper
plane."""
LOWER, UPPER = Plane(point=(0, 0, 0)), Plane(point=(0, 0, 0.5), normal=(0, 0, -1))


def falling(lower=None, group=None, **more):
    """Grains that fall until those below one plane and above another join two groups."""
    effects = (
        PrescribedMotion(name="down", group=1, motion=lower or Translation(velocity=SPEED)),
        PrescribedMotion(name="up", group=2, motion=Rotation(rate=RATE)),
        Gravity(acceleration=(0, 0, -G)),
        JoinGroup(name="below", planes=[LOWER], group=group or 1, time=JOINS),
        JoinGroup(name="above", planes=[UPPER], group=2, time=JOINS),
        MeanForce(begin=0.05),
    )
    quantities = {"group": [0, 0, 0, 0, 2]}
    return scene(
        PLACE, np.zeros_like(PLACE), effects, mass=[1.0, 2, 3, 4, 5], dt=DT, steps=STEPS,
        quantities=quantities, **more,
    )  # fmt: skip


def fallen(t):
    """Height change in free fall, for which Verlet is exact."""
    return -G * t**2 / 2


@pytest.mark.long
def test_layers_join_at_the_given_time_and_follow_the_group():
    (result,) = simulate([falling()], worlds=2, capacity=8)
    state, t, joined = by_id(result), 31 * DT, fallen(31 * DT)
    assert result.work["joined"] == 3
    np.testing.assert_array_equal(state["group"], [1, 0, 1, 2, 2])
    rest = DT * STEPS - t
    expected = PLACE.copy()
    expected[[0, 2, 3], 2] += joined
    expected[[0, 2]] += np.array(SPEED) * rest
    expected[1, 2] += fallen(DT * STEPS)
    # The other grain belongs to this group from the start.
    for i, turned in ((3, 2.0 * rest), (4, 2.0 * DT * STEPS)):
        x, y = PLACE[i, :2]
        expected[i, :2] = (
            np.cos(turned) * x - np.sin(turned) * y,
            np.sin(turned) * x + np.cos(turned) * y,
        )
    np.testing.assert_allclose(state["position"], expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(state["velocity"][[0, 2]], [SPEED, SPEED], rtol=1e-12)
    np.testing.assert_allclose(state["spin"][[3, 4]], [RATE, RATE], rtol=1e-12)
    np.testing.assert_array_equal(state["body_mass"][[0, 2, 3]], 2.0**40 * np.array([1.0, 3, 4]))
    assert result.measures["down_force_z"] == pytest.approx(-4 * G, rel=1e-12)


TIMES = ((1e-3, 0.0305), (1e-6, 4e-5), (1e-7, 2e-5), (1e-8, 2e-5), (5e-9, 2e-5))
"""Steps (s) and joining times (s), most of which are a whole number of steps."""
LAYER = 130
"""Number of grains that join; more than one block of a sum."""


def settled(dt, time, step):
    """A layer that joins, and one grain that crosses the plane half a step too late."""
    place = np.zeros((LAYER + 1, 3))
    place[:, 2] = -1.0
    place[LAYER // 2, 2], velocity = 1.0, np.zeros_like(place)
    velocity[LAYER // 2, 2] = -1.0 / ((step + 0.5) * dt)
    effects = (PrescribedMotion(group=1), JoinGroup(planes=[LOWER], time=time))
    return scene(place, velocity, effects, dt=dt, steps=step + 4)


@pytest.mark.long
def test_a_group_is_joined_once_despite_rounding_of_times():
    """Grains join at the end of the first step that reaches the time, and none in the next step."""
    scenes, real = [], np.dtype(runtime.current().precision.replace("f", "float")).type
    for pair in TIMES:
        dt, time = (float(real(value)) for value in pair)
        scenes.append(settled(dt, time, int(np.ceil(time / dt - 1e-6))))
    for result in simulate(scenes, worlds=len(scenes), capacity=2 * LAYER):
        group = by_id(result)["group"]
        assert result.work["joined"] == LAYER == group.sum()
        assert group[LAYER // 2] == 0
        assert result.state["position"][:, 2].max() < 0


@pytest.mark.long
def test_the_mean_force_covers_the_steps_since_its_start():
    """For a constant force the mean equals the force; before its start it is 0."""
    one = falling()
    late = (*one.effects[:-1], MeanForce(begin=1.0))
    kept, none = simulate([one, one.model_copy(update={"effects": late})], worlds=2, capacity=8)
    weights = np.outer(np.arange(1.0, 6), [0, 0, -G])
    np.testing.assert_allclose(by_id(kept)["mean_force"], weights, rtol=1e-12)
    assert not none.state["mean_force"].any()


BEGINS = (0.0, 0.0305, 0.0995)
"""Start times (s); the second is within a step, the third within the last step."""


@pytest.mark.long
def test_the_mean_of_a_varying_force_is_its_time_integral():
    """Each step contributes the force at its beginning; the first step contributes only its part after the
    start."""
    shake, omega = np.array([1.0, -2.0, 3.0]), 40.0
    scenes = [
        scene(
            [[0, 0, 0]], [[0, 0, 0]],
            (Trap(stiffness=0.0, shake=tuple(shake), omega=omega), MeanForce(begin=begin)),
            mass=2.0, dt=DT, steps=STEPS,
        )
        for begin in BEGINS
    ]  # fmt: skip
    start = DT * np.arange(STEPS)
    for begin, result in zip(BEGINS, simulate(scenes, worlds=len(scenes), capacity=4), strict=True):
        lasts = np.clip(start + DT - begin, 0.0, DT)
        mean = 2.0 * shake * (np.cos(omega * start) * lasts).sum() / (DT * STEPS - begin)
        few = 1e3 * roundoff()
        np.testing.assert_allclose(result.state["mean_force"][0], mean, rtol=few, atol=few)


@pytest.mark.slow
def test_joined_grains_exert_no_forces_on_each_other():
    """Two grains press on each other and on a third; once the two are frozen, only the third exerts a
    force."""
    law = Granular(normal=HertzMaterial())
    place = RADIUS * np.array([[0.0, 0, -0.8], [1.9, 0, -0.8], [0.95, 0, 0.8]])
    effects = (
        PrescribedMotion(group=1),
        law,
        JoinGroup(planes=[LOWER], time=1e-9),
    )
    made = scene(
        place, 0 * place, effects, dt=1e-9, steps=2, materials={"grain": Material(young=1e7, poisson=0.3)}
    )
    (result,) = simulate([made], capacity=4)
    state = by_id(result)
    np.testing.assert_array_equal(state["group"], [1, 1, 0])
    reduced, modulus = RADIUS / 2, 1e7 / (2 * (1 - 0.3**2))
    apart = np.linalg.norm(place[2] - place[0])
    press = 4 / 3 * modulus * np.sqrt(reduced) * (2 * RADIUS - apart) ** 1.5
    np.testing.assert_allclose(np.linalg.norm(state["force"][:2], axis=1), press, rtol=1e-4)


def test_a_group_of_no_motion_is_refused():
    with pytest.raises(InputError, match=r"effects\.below\.group must be the group of a prescribed motion"):
        Simulation(falling(group=3))
