"""Walls at rest: grains that lie, roll, slide and stick, each against its closed form."""

import numpy as np
import pytest

from tests.effects.contact.grains import CAPACITY, FLOOR, USUAL, WORLDS, grains, run
from tests.scenes import compiled
from tisim.cases.common.two_spheres import hertz_overlap

E_STAR = USUAL["young"] / (2 * (1 - USUAL["poisson"] ** 2))
G_STAR = USUAL["young"] / (4 * (2 - USUAL["poisson"]) * (1 + USUAL["poisson"]))


def sunk(push):
    """The overlap (m) at which a wall pushes a grain of 1 m radius with the force ``push`` (N)."""
    return float(hertz_overlap(push, 1.0, E_STAR))


def lying(velocity, gravity, planes=(FLOOR,), spin=(0, 0, 0), **more):
    """A grain of 1 kg that lies on the floor, with the overlap of its weight."""
    return grains([[0, 0, 1 - sunk(-gravity[2])]], [velocity], [spin], planes, gravity, **more)


def speeds(result):
    """Velocity along x, and the spin for rolling in that direction."""
    return result.state["velocity"][0, 0], result.state["spin"][0, 1]


@pytest.mark.long
def test_a_sliding_sphere_starts_to_roll():
    """It slows down by mu g, and rolls from the time v / (mu g (1 + 5 L^2 / (2 R^2))) on. Its speed is then
    5/7 v for a lever arm L = R; the overlap of its weight makes L slightly smaller."""
    speed, friction, g = 1.0, 0.3, 10.0
    lever = 1 - sunk(g) / 2
    end = speed / (friction * g * (1 + 2.5 * lever**2))
    assert end == pytest.approx(2 * speed / (7 * friction * g), rel=1e-3)
    law = {"friction": friction, "restitution": 0.5}
    made = lying((speed, 0, 0), (0, 0, -g), law=law, dt=1e-4, steps=4000)
    simulation = compiled(made, WORLDS, CAPACITY)
    simulation.load([made])
    simulation.run(until=0.99 * end)
    (before,) = simulation.results()
    simulation.run()
    (rolls,) = simulation.results()
    (v, spin), t = speeds(before), before.time
    # The tolerance is a thousandth of a step of sliding, because the spring is unstretched at the start.
    assert v == pytest.approx(speed - friction * g * t, abs=2e-4)
    assert spin == pytest.approx(2.5 * friction * g * lever * t, abs=5e-4)
    v, spin = speeds(rolls)
    assert v == pytest.approx(speed / (1 + 0.4 / lever**2), rel=1e-4)
    assert lever * spin == pytest.approx(v, rel=1e-4)
    assert v == pytest.approx(5 / 7, rel=1e-3)
    assert rolls.state["position"][0, 2] == pytest.approx(1 - sunk(g), abs=1e-9)


def test_a_sphere_rolls_on_gentle_and_slides_on_steep_slopes():
    """While tan is below 7/2 mu (for a lever arm R), the acceleration is 5/7 g sin; beyond, it is g (sin - mu
    cos)."""
    g, friction, t = 10.0, 0.2, 0.4
    for tangent in (0.1, 0.4, 0.65, 0.75, 2.0):
        sine, cosine = tangent / np.hypot(1, tangent), 1 / np.hypot(1, tangent)
        law = {"friction": friction, "restitution": 0.5}
        made = lying((0, 0, 0), (g * sine, 0, -g * cosine), law=law, dt=1e-4, steps=4000)
        v, spin = speeds(run([made])[0])
        lever = 1 - sunk(g * cosine) / 2
        rolls = tangent < friction * (1 + 2.5 * lever**2)
        assert rolls == (tangent < 0.7)
        pull = g * sine / (1 + 0.4 / lever**2) if rolls else g * (sine - friction * cosine)
        assert v == pytest.approx(pull * t, rel=2e-3)
        turned = v / lever if rolls else 2.5 * friction * g * cosine * lever * t
        assert spin == pytest.approx(turned, rel=5e-3)


PRESSED = 0.01
PUSH = 4 / 3 * E_STAR * PRESSED**1.5
"""m, N, for each of two walls with a grain between them."""
SLOT = [((0.0, 0.0, -1 + PRESSED), (0.0, 0.0, 1.0)), ((0.0, 0.0, 1 - PRESSED), (0.0, 0.0, -1.0))]


def test_a_grain_between_two_walls_hangs_by_mindlins_springs():
    """It falls and comes back, as on two springs of 8 G* sqrt(R delta) each, and does not rotate."""
    stiffness = 2 * 8 * G_STAR * PRESSED**0.5
    period, weight, steps = 2 * np.pi / stiffness**0.5, 0.3 * 2 * PUSH / 4, 400
    made = grains([[0, 0, 0]], [[0, 0, 0]], planes=SLOT, gravity=(-weight, 0, 0),
                  law={"restitution": 1.0, "friction": 0.3}, dt=period / steps, steps=10 * steps)  # fmt: skip
    simulation = compiled(made, WORLDS, CAPACITY)
    simulation.load([made])
    for quarters in (1, 2, 3, 4, 38, 40):
        simulation.run(until=(quarters - 0.01 / steps) * period / 4)
        (result,) = simulation.results()
        fallen = -weight / stiffness * (1 - np.cos(quarters * np.pi / 2))
        assert result.state["position"][0, 0] == pytest.approx(fallen, abs=2e-3 * weight / stiffness)
    np.testing.assert_array_equal(result.state["spin"], 0)
    np.testing.assert_array_equal(result.state["position"][0, 1:], 0)


def test_a_grain_between_two_walls_stays_below_coulombs_limit_and_slides_above_it():
    """The limit is twice mu times the push of a wall: below, it comes to rest; above, it falls with the
    excess force."""
    friction = 0.3
    limit, stiffness = 2 * friction * PUSH, 2 * 8 * G_STAR * PRESSED**0.5
    for part in (0.4, 0.95, 1.05, 2.0):
        made = grains([[0, 0, 0]], [[0, 0, 0]], planes=SLOT, gravity=(-part * limit, 0, 0),
                      law={"restitution": 0.3, "friction": friction}, dt=1e-5, steps=20_000)  # fmt: skip
        (result,) = run([made])
        fallen, v = result.state["position"][0, 0], result.state["velocity"][0, 0]
        if part < 1:
            assert abs(v) < 1e-9 * limit
            # At first it feels its whole weight at once, so it slides a little if that is near the limit.
            hangs = -part * limit / stiffness
            assert fallen == pytest.approx(hangs, rel=1e-6) if part < 0.5 else -0.1 < fallen < hangs
        else:
            # Stretching the springs takes some time.
            assert v == pytest.approx((1 - part) * limit * result.time, abs=limit / stiffness**0.5)


def test_walls_do_not_depend_on_point_and_normal_length():
    """A plane that is tilted, and one given by another point and a longer normal: the same motion to
    rounding."""
    normal = np.array([1.0, 2.0, 2.0]) / 3
    along = np.array([2.0, -2.0, 1.0]) / 3
    there = np.array([3.0, -1.0, 5.0])
    ends = []
    for point, given in ((there, normal), (there + 40 * along, 7 * normal)):
        made = grains([there + normal], [-normal + along], planes=[(tuple(point), tuple(given))],
                      law={"restitution": 0.7}, dt=1e-4, steps=200)  # fmt: skip
        (result,) = run([made])
        assert result.state["velocity"][0] @ normal == pytest.approx(0.7, abs=0.01)
        assert result.state["velocity"][0] @ np.cross(normal, along) == pytest.approx(0, abs=1e-12)
        ends.append(result.state["velocity"][0])
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-9)


def test_in_a_corner_forces_of_walls_add_up():
    """The force is the sum over the walls; each contact has its own history."""
    planes = [((0.0, 0.0, 0.0), tuple(axis)) for axis in np.eye(3)]
    place, velocity, spin = [[0.97, 0.98, 0.99]], [[0.3, -0.2, 0.1]], [[1.0, 2.0, 3.0]]

    def loads(some):
        made = grains(place, velocity, spin, planes=some, dt=1e-5, steps=1)
        (result,) = run([made])
        return np.concatenate([result.state[name] - result.start[name] for name in ("velocity", "spin")])

    together, alone = loads(planes), sum(loads([plane]) for plane in planes)
    np.testing.assert_allclose(together, alone, rtol=0, atol=5e-3 * np.abs(together).max())
    assert np.abs(together).min() > 0
