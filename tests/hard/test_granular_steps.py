"""Time steps beyond the stability limit of the springs and dashpots of a contact, for each mode of motion.

Just below the limit a motion stays small. Just beyond it the motion grows in the NumPy reference, which has
no guard, and tisim stops the world.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.effects.contact.grains import AWAY, reference
from tests.effects.contact.granular_reference import law_of
from tests.hard.granular_scenes import ELASTIC, grains, loaded, push
from tests.scenes import by_id, scene, simulate
from tests.throwaway import Trap
from tisim import InputError, Material
from tisim.effects import Granular, Hooke

pytestmark = pytest.mark.slow

FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
G, TINY = 10.0, 1e-4
"""Gravity (m/s^2), and the size of the initial velocities (m/s) and spins (rad/s)."""
STICKS, ROLLS, TWISTS = {"friction": 1e3}, {"rolling_friction": 1e3}, {"twisting_friction": 1e3}
WAYS = {
    "hooke": {
        "slides": STICKS,
        "slides, damped": {**STICKS, "restitution": 0.3},
        "rolls": {**ROLLS, "rolling_stiffness": 9e4},
        "rolls, damped": {**ROLLS, "rolling_damping": 900.0},
        "twists": {**TWISTS, "twisting_stiffness": 9e4},
        "twists, damped": {**TWISTS, "twisting_damping": 900.0},
        "slides and rolls": {**STICKS, **ROLLS, "rolling_stiffness": 1e4, "rolling_damping": 20.0},
    },
    "jkr": {
        "slides": STICKS,
        "slides, damped": {**STICKS, "viscous_time": 0.01},
        "rolls": {"rolling_friction": 2.0},
        "slides and rolls": {**STICKS, "rolling_friction": 0.7},
        "a pair slides and rolls": {**STICKS, "rolling_friction": 0.7, "surface_energy": 20.0},
    },
    "dmt": {"slides, damped": {**STICKS, "damping": 2e4, "rolling_friction": 0.5}},
    "mindlin": {"slides": STICKS, "slides, damped": {**STICKS, "restitution": 0.3}},
}
"""For each law and mode of motion, the material properties in addition to the elastic repulsion."""
PAIR = {"radius": np.array([1.0, 0.3]), "mass": np.array([1.0, 0.05])}


def nearly_at_rest(name, way, dt, steps, **more_of_it):
    """A grain on a floor, or an adhesive pair, in balance normal to the contact and with small tangential
    motion.

    Returns the scene and the overlap (m).
    """
    law, rng = {**ELASTIC[name], **WAYS[name][way], **more_of_it}, np.random.default_rng(1)
    more = {"first": law, "dt": dt, "steps": steps}
    if "pair" in way:
        reduced = PAIR["radius"].prod() / PAIR["radius"].sum()
        overlap = brentq(lambda d: push(name, d, reduced, law), 0, 0.2, xtol=1e-16)
        place = [[0, 0, 5], [PAIR["radius"].sum() - overlap, 0, 5]]
        more, across = {**more, **PAIR}, np.array([0, 1, 1])
    else:
        overlap = brentq(lambda d: push(name, d, 1.0, law) - G, 0, 0.2, xtol=1e-16)
        place, across = [[0, 0, 1 - overlap]], np.array([1, 1, 0])
        more.update(planes=[FLOOR], gravity=(0, 0, -G))
    velocity, spin = TINY * rng.normal(size=(2, len(place), 3))
    return grains(name, place, velocity * across, spin, **more), overlap


def springs(made, overlap, radius, mass):
    """Spring and dashpot constants of the normal, sliding, rolling and twisting modes; zero without
    friction."""
    law, which = law_of(made), np.zeros((1, 2), int)
    soft = law.materials[0]
    circle, stiffness, *_ = law.press(which, np.array([overlap]), np.array([radius]))
    damping = law.loss(which, np.broadcast_to(stiffness, 1), np.array([mass]))
    slides = np.ravel(law.tangential_constants(which, stiffness, damping)[:2]) * (soft["friction"] > 0)
    rolls, twists = np.zeros(2), np.zeros(2)
    if law.rolling == "rolling_sds":
        rolls, twists = (
            np.array([soft[f"{way}_stiffness"], soft[f"{way}_damping"]]) * (soft[f"{way}_friction"] > 0)
            for way in ("rolling", "twisting")
        )
    if law.rolling == "rolling_epsd":
        rolls[0] = 2.25 * soft["rolling_friction"] ** 2 * stiffness[0]
        rolls[1] = 2 * law.options["rolling_damping_ratio"] * np.sqrt(rolls[0] * mass)
        twists = slides * circle[0] ** 2 / 2
    return np.array([np.ravel([stiffness, damping]), slides, rolls, twists])


def inverse_masses(overlap, radius, mass):
    """Inverse masses of the normal, sliding and rolling modes (1/kg) and of twisting (1/(kg m^2)), R* (m) and
    m* (kg).

    The rolling force is the couple divided by R*. Sliding and rolling are coupled.
    """
    inverse, inertia = 1 / mass, 1 / (0.4 * mass * radius**2)
    arm, effective = radius - overlap / 2, 1 / (1 / radius).sum()
    sign = np.array([1, -1])[: len(radius)]
    out = np.diag([inverse.sum(), inverse.sum() + (arm**2 * inertia).sum(), 0, inertia.sum()])
    out[2, 2] = effective**2 * inertia.sum()
    out[1, 2] = out[2, 1] = effective * (sign * arm * inertia).sum()
    return out, effective, 1 / inverse.sum()


def limit(name, way):
    """The largest stable step (s) and the mode that grows beyond it.

    Half kicks of springs K and dashpots C with inverse masses B are stable if B (K dt^2 + 2 C dt) has no
    eigenvalue above 4.
    """
    made, overlap = nearly_at_rest(name, way, 1.0, 1)
    start = made.start()
    inverse, radius, mass = inverse_masses(overlap, start["radius"], start["mass"])
    k, c = springs(made, overlap, radius, mass).T

    def worst(dt):
        values, vectors = np.linalg.eig(inverse @ np.diag(k * dt**2 + 2 * c * dt))
        return values.max(), np.abs(vectors[:, values.argmax()]).argmax()

    dt = brentq(lambda dt: worst(dt)[0] - 4, 1e-9, 1.0, xtol=1e-16)
    return dt, worst(dt)[1]


def fastest(velocity, spin):
    return max(np.abs(velocity).max(), np.abs(spin).max())


CASES = [(name, way) for name, ways in WAYS.items() for way in ways]


@pytest.mark.parametrize(("name", "way"), CASES)
def test_motion_grows_beyond_the_limit(name, way):
    """The NumPy reference, which has no guard, grows beyond the limit until surfaces slip; it is not the
    normal mode that grows."""
    dt, grows = limit(name, way)
    assert grows > 0
    for part in (0.98, 1.02):
        made, _ = nearly_at_rest(name, way, part * dt, 1)
        known = reference(made)
        first, most = fastest(known.v, known.w), 0.0
        for _ in range(500):
            known.run(1, part * dt)
            most = max(most, fastest(known.v, known.w) / first)
            if most > 10:
                break
        assert (most > 10) == (part > 1)


@pytest.mark.parametrize("name", WAYS)
def test_steps_beyond_the_limit_stop_the_world(name):
    """The message names the law and the likely causes, and the last good state, here the start, is kept."""
    tried = [(way, part) for way in WAYS[name] for part in (0.98, 1.02)]
    made = [nearly_at_rest(name, way, part * limit(name, way)[0], 400)[0] for way, part in tried]
    simulation = loaded(made)
    simulation.run()
    for (way, part), one, result in zip(tried, made, simulation.results(), strict=True):
        start = one.start()
        if part < 1:
            assert result.status.ok, (way, result.status.reason)
            speed = fastest(result.state["velocity"], result.state["spin"])
            assert speed < 10 * fastest(start["velocity"], start["spin"]), way
        else:
            by = "granular" if "pair" in way else "walls"
            for word in ("not finite", f"effects.{by}", "particle 0"):
                assert word in result.status.reason, (way, result.status.reason)
            for field in ("position", "velocity", "spin"):
                np.testing.assert_array_equal(result.state[field], start[field], err_msg=way)


def half_kicks(n, dt, held):
    """Matrix of one step with half kicks for a row of undamped grains of 1 kg and springs of 1 N/m.

    It acts on positions and velocities. held : stiffness of a spring from each grain to its place, N/m.
    """
    neighbours = np.eye(n, k=1) + np.eye(n, k=-1)
    pull, still = np.diag(neighbours.sum(axis=1) + held) - neighbours, np.zeros((n, n))
    kick = np.block([[np.eye(n), still], [-0.5 * dt * pull, np.eye(n)]])
    drift = np.block([[np.eye(n), dt * np.eye(n)], [still, np.eye(n)]])
    return kick @ drift @ kick


OF_A_PAIR = np.sqrt(2.0)
"""Stability limit (s) of a pair of 1 kg each with 1 N/m: S dt^2 = 4 m*."""


@pytest.mark.parametrize(("grains_in_row", "part"), [(2, 1.0), (3, 0.8165), (10, 0.7159), (100, 0.7071)])
def test_rows_have_shorter_limits_the_longer_they_are(grains_in_row, part):
    """In NumPy a row of n grains is unstable from 1 / (sqrt(2) cos(pi / (2 n))) times the limit of a pair."""

    def growth(dt):
        return np.abs(np.linalg.eigvals(half_kicks(grains_in_row, dt, 0.0))).max()

    assert part == pytest.approx(1 / (np.sqrt(2) * np.cos(np.pi / (2 * grains_in_row))), abs=1e-4)
    assert growth(0.999 * part * OF_A_PAIR) == pytest.approx(1.0, abs=1e-6)
    assert growth(1.001 * part * OF_A_PAIR) > 1.01


def test_three_grains_in_a_row_have_a_shorter_limit_than_a_pair():
    """Three grains pressed together by a weak central spring, so that contacts last, move a little.

    They follow the half kicks in NumPy. Beyond the limit for three grains the motion grows without bound, as
    the guard only knows the limit of a pair.
    """
    held, k = 1e-3, 1e4
    overlap, tiny, steps = 2 * held / (1 + held), 1e-7 * np.array([1.0, -2.0, 1.0]), 20
    place = np.array([[overlap - 2, 0, 5], [0, 0, 5], [2 - overlap, 0, 5]])
    acting = (Granular(normal=Hooke()), Trap(stiffness=held * k, centre=(0.0, 0.0, 5.0)))
    parts, made = (0.98, 1.02), []
    for part in parts:
        made.append(
            scene(place, tiny[:, None] * [1, 0, 0], acting, radius=1.0, mass=1.0, steps=steps,
                  dt=part * 0.8165 * OF_A_PAIR / np.sqrt(k), materials={"iron": Material(stiffness=k)})
        )  # fmt: skip
    for part, result in zip(parts, simulate(made, worlds=2, capacity=4), strict=True):
        assert result.status.ok, result.status.reason
        step = half_kicks(3, part * 0.8165 * OF_A_PAIR, held)
        speed = (np.linalg.matrix_power(step, steps) @ np.append(0 * tiny, tiny))[3:]
        found = by_id(result)["velocity"][:, 0]
        np.testing.assert_allclose(found, speed, rtol=0, atol=1e-5 * np.abs(speed).max())
        grown = (speed**2).sum() / (tiny**2).sum()
        assert grown < 2 if part < 1 else grown > 1e5


def test_springs_without_friction_stop_nothing():
    """Springs that act only through friction have no limit if the friction is zero, however stiff they
    are."""
    idle = {"rolling_stiffness": 1e9, "twisting_stiffness": 1e9, "rolling_damping": 1e9}
    made, _ = nearly_at_rest("hooke", "slides", 0.9 * limit("hooke", "slides")[0], 400, **idle)
    simulation = loaded([made])
    simulation.run()
    assert simulation.results()[0].status.ok, simulation.results()[0].status.reason


def test_cohesion_above_the_stiffness_stops_the_world(monkeypatch):
    """This happens to grains that have grown or been inserted.

    At the start such grains are refused, so the test disables that check.
    """
    radius, k = np.array([1.0, 3.0]), ELASTIC["hooke"]["stiffness"]
    most = k / (2 * np.pi * radius.prod() / radius.sum())
    made = [
        grains("hooke", [[0, 0, 5], [4 - 1e-6, 0, 5]], np.zeros((2, 3)), radius=radius, dt=1e-4, steps=100,
               planes=[(AWAY[0], AWAY[1])], first={"cohesion_energy_density": part * most})
        for part in (0.99, 1.01)
    ]  # fmt: skip
    with pytest.raises(InputError, match="cohesion must be below"):
        loaded(made)
    for name in ("check_start", "check_wall"):
        monkeypatch.setattr(Granular, name, lambda *_: None)
    simulation = loaded(made)
    simulation.run()
    below, above = simulation.results()
    assert below.status.ok, below.status.reason
    assert "effects.granular, at particle 0 (this happens if " in above.status.reason
    assert "or no elastic force holds the cohesion there" in above.status.reason
    np.testing.assert_array_equal(above.state["position"], above.start["position"])
