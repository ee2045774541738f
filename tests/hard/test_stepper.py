"""Extreme cases of steppers: stiff springs, large mass ratios, sudden forces, and a fall into a singularity.

Each stepper has one compiled structure of forces; each scene sets the forces it does not need to zero.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.scenes import by_id, compiled, fixed, scene, simulate
from tests.throwaway import SoftShellOfAll
from tisim.effects import Contact, NearField, Tether
from tisim.steppers import Collocation, ErrorControl, StageControl, Trapezoid

WORLDS = 16
TRAPEZOID, COLLOCATION = {"error": 1e-6, "tolerance": 1e-8}, {"error": 1e-8}
STEPPERS = {
    "trapezoid": lambda limits: Trapezoid(control=ErrorControl(**TRAPEZOID, **limits)),
    "anderson": lambda limits: Trapezoid(
        control=ErrorControl(**TRAPEZOID, **limits), acceleration="anderson"
    ),
    "collocation": lambda limits: Collocation(control=StageControl(**COLLOCATION, **limits)),
}


NAMES = [
    "trapezoid",
    pytest.param("anderson", marks=pytest.mark.slow),
    pytest.param("collocation", marks=pytest.mark.slow),
]


def adaptive(name, first, longest, **more):
    """A stepper with error-controlled steps that start at ``first`` (s)."""
    return STEPPERS[name]({"first": first, "longest": longest, "shortest": 1e-14, **more})


def forced(
    position, velocity, stepper, duration, tether=0.0, shell=1e-100, width=1e-100, near=(0, 0), **more
):
    """Particles on springs within elastic shells; they attract by near[0]/d and repel by near[1]/d^2."""
    effects = (
        SoftShellOfAll(stiffness=shell, width=width),
        NearField(alpha1=near[0], alpha2=near[1]),
        Tether(stiffness=(tether,) * 3),
    )
    return scene(position, velocity, effects, stepper=stepper, duration=duration, **more)


def run(scenes):
    return simulate(scenes, worlds=WORLDS, capacity=2)


def good(results):
    for result in results:
        assert result.status.ok, result.status.reason
    return results


def kinetic(state):
    return 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum()


FACTORS = (1.0, 1e2, 1e6)


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_stiffness_far_beyond_the_first_step(name):
    """Springs 1, 1e2 and 1e6 times as stiff with the same control; the first step is up to 20 radians long.

    After 3 1/4 periods each particle is at the centre at full speed, after nearly the same number of steps.
    """
    scenes = []
    for factor in FACTORS:
        period = 2 * np.pi / np.sqrt(4.0 * factor)
        stepper = adaptive(name, 0.01, 0.1)
        more = {"mass": 1.0, "tether": 4.0 * factor, "quantities": {"anchor": np.zeros((1, 3))}}
        scenes.append(forced([[1.0, 0, 0]], [[0, 0, 0]], stepper, 3.25 * period, **more))
    results = good(run(scenes))
    for factor, result in zip(FACTORS, results, strict=True):
        np.testing.assert_allclose(result.state["position"], 0, atol=1e-4)
        np.testing.assert_allclose(result.state["velocity"][0, 0], -2 * np.sqrt(factor), rtol=1e-6)
        assert result.time == result.scene.duration
    steps = [result.work["steps"] for result in results]
    assert max(steps) < 1.2 * min(steps) + 10
    assert results[2].work["rejections"] >= 2


def test_explicit_steps_too_long_for_a_spring_fail_clearly():
    """Verlet beyond w dt = 2 grows without bound: the run is stopped and the state kept is finite."""
    more = {"mass": 1.0, "quantities": {"anchor": np.zeros((1, 3))}}
    stable, stiff = run(
        [forced([[1.0, 0, 0]], [[0, 0, 0]], fixed(0.01), 10.0, tether=4.0 * f, **more) for f in (1.0, 1e6)]
    )
    assert stable.status.ok
    np.testing.assert_allclose(stable.state["position"][0, 0], np.cos(2 * 10.0), atol=1e-3)
    assert not stiff.status.ok
    assert "the critical one at most 0.001 s, by effects.tether" in stiff.status.reason
    assert "particle 0" in stiff.status.reason
    assert all(np.isfinite(values).all() for values in stiff.state.values())
    assert stiff.time < 10.0


def pull(x):
    """Force (N) between two particles that attract by 2/d and repel by 1/d^2, at d = x."""
    return 2.0 / x - 1.0 / x**2


@pytest.mark.parametrize("name", [*NAMES, "verlet"])
def test_masses_a_million_apart(name):
    """1e-3 kg and 1e3 kg vibrate about d = 1/2, in both orders.

    The distance follows a SciPy solution with the reduced mass. The total momentum stays below a billionth of
    the exchanged momentum.
    """
    light, heavy = 1e-3, 1e3
    reduced, duration = light * heavy / (light + heavy), 1.003
    stepper = fixed(2e-5) if name == "verlet" else adaptive(name, 1e-3, 1e-2)
    scenes = [
        forced([[0, 0, 0], [0.6, 0, 0]], np.zeros((2, 3)), stepper, duration, near=(2, 1), mass=mass)
        for mass in ([light, heavy], [heavy, light])
    ]
    exact = solve_ivp(
        lambda _, y: [y[1], -pull(y[0]) / reduced],
        (0, duration),
        [0.6, 0.0],
        "DOP853",
        rtol=1e-11,
        atol=1e-11,
    ).y[:, -1]
    for result in good(run(scenes)):
        state = by_id(result)
        distance = state["position"][1, 0] - state["position"][0, 0]
        opening = state["velocity"][1, 0] - state["velocity"][0, 0]
        # For an amplitude of 0.1 m and a speed of 10 m/s.
        assert distance == pytest.approx(exact[0], abs=2e-5)
        assert opening == pytest.approx(exact[1], abs=2e-3)
        total = (state["mass"][:, None] * state["velocity"]).sum(axis=0)
        exchanged = light * np.abs(state["velocity"]).max()
        np.testing.assert_allclose(total, 0, atol=1e-9 * exchanged)
        energy = kinetic(state) + 2 * np.log(distance) + 1 / distance
        assert energy == pytest.approx(2 * np.log(0.6) + 1 / 0.6, rel=1e-7)


MEETINGS = 1e-3 + 1e-4 * (1 - np.append(np.geomspace(1e-9, 1, 13), [0.3, 0.7]))
"""Times (s) between the ends of the tenth and the eleventh step of 1e-4 s, and just before the latter."""


@pytest.mark.parametrize("name", [*NAMES, "verlet"])
def test_a_sudden_force(name):
    """Two shells meet at 200 m/s after a flight in the longest steps, each a tenth of the shell.

    They rebound as a linear spring does: v' = -v, half a period later.
    """
    k, m, v, width = 2e6, 1.0, 100.0, 0.2
    contact = np.pi / np.sqrt(2 * k / m)
    assert v * np.sqrt(m / (2 * k)) < width, "the spring must stop them before their centres meet"
    stepper = fixed(1e-6) if name == "verlet" else adaptive(name, 1e-4, 1e-4)
    places = 1e-9 + width / 2 + v * np.array([MEETINGS, 2.5e-3 - MEETINGS])
    speed, more = [[v, 0, 0], [-v, 0, 0]], {"shell": k, "width": width, "radius": 1e-9, "mass": m}
    scenes = [
        forced([[-half, 0, 0], [half, 0, 0]], speed, stepper, 2.5e-3 + contact, **more) for half in places[0]
    ]
    for place, result in zip(places[1], good(run(scenes)), strict=True):
        state = by_id(result)
        np.testing.assert_allclose(state["velocity"][:, 0], [-v, v], rtol=5e-6)
        np.testing.assert_allclose(state["position"][:, 0], [-place, place], rtol=5e-6)


@pytest.mark.slow
def test_steps_grow_again_after_a_contact():
    """Grains of any speed that meet in mid-step rebound with their energy, in few steps.

    The stepper must not keep the short steps of the contact because of an outdated contraction rate.
    """
    radius, speeds = 1e-3, np.geomspace(0.1, 100, 10)
    scenes = [
        scene(
            radius * np.array([[-5, 0, 0], [5, 0, 0]]),
            [[v, 0, 0], [-v, 0, 0]],
            (Contact(stiffness=1e11),),
            radius=radius,
            stepper=Collocation(control=StageControl(longest=longest * radius / v)),
            duration=12 * radius / v,
        )
        for v in speeds
        # With two long steps the grains would pass without detecting each other.
        for longest in (0.3, 0.9)
    ]
    simulation = compiled(scenes[0], worlds=len(scenes), capacity=2)
    simulation.load(scenes)
    simulation.run(steps=1000)
    for v, result in zip(np.repeat(speeds, 2), good(simulation.results()), strict=True):
        np.testing.assert_allclose(by_id(result)["velocity"][:, 0], [-v, v], rtol=1e-5)
        assert result.work["steps"] < 100


@pytest.mark.parametrize("name", NAMES)
def test_a_fall_into_a_singularity(name):
    """Two particles attracted by 1/d fall head-on from rest, v^2 = 2 alpha ln(d_0/d)/m_reduced.

    The result is right as long as the steps can follow. After that the run stops before numbers are wrong,
    names the force and keeps the state.
    """
    # They meet after d_0 sqrt(pi m_reduced / (2 alpha)).
    fall = np.sqrt(np.pi / 4)
    # By default distances below a thousandth of a radius are not resolved; here all are.
    stepper = adaptive(name, 1e-3, 0.1, resolution=0.0)
    scenes = [
        forced([[0, 0, 0], [1.0, 0, 0]], np.zeros((2, 3)), stepper, end * fall, near=(1, 0), mass=1.0)
        for end in (0.99, 2.0)
    ]
    early, late = run(scenes)
    assert early.status.ok
    assert early.time == early.scene.duration
    for result in (early, late):
        state = by_id(result)
        distance = abs(state["position"][1, 0] - state["position"][0, 0])
        assert kinetic(state) == pytest.approx(-np.log(distance), rel=1e-4)
        np.testing.assert_allclose(state["velocity"].sum(axis=0), 0, atol=1e-12)
    assert "cannot be solved even at the shortest step, by effects.near_field" in late.status.reason
    assert late.time <= fall * (1 + 1e-6)
