"""Impacts under Hertz and Mindlin: restitution, Hertz's duration and depth, friction, and energy loss."""

import numpy as np
import pytest
from scipy.integrate import quad

from tests.effects.contact.grains import AWAY, CAPACITY, FLOOR, USUAL, WORLDS, grains, run
from tests.scenes import by_id, compiled, fixed
from tisim import Simulation
from tisim.cases.common.two_spheres import hertz_depth, hertz_duration
from tisim.steppers import Boris, FixedStep, IterationControl, Trapezoid

E_STAR = USUAL["young"] / (2 * (1 - USUAL["poisson"] ** 2))


def depth(speed, radius=1.0, mass=1.0):
    """Largest overlap (m) of an elastic impact at a speed, for R* and m*."""
    return float(hertz_depth(speed, radius, mass, E_STAR))


def duration(speed, radius=1.0, mass=1.0):
    """Duration of an elastic impact, s."""
    return float(hertz_duration(speed, radius, mass, E_STAR))


SPEEDS, RESTITUTIONS = (0.01, 0.1, 1.0, 10.0), (0.1, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
EXACT = np.array(RESTITUTIONS)[:, None]


def restitutions(steps):
    """Restitution of a head-on impact of two unlike grains, and of one at a wall: by speed (rows) and e.
    ``steps`` is the number of steps in an elastic impact at the wall."""
    made = [
        grains(
            [[10, 0, 50], [11.5, 0, 50], [0, 0, 1]],
            [[v, 0, 0], [-v / 2, 0, 0], [0, 0, -v]],
            planes=[FLOOR],
            law={"restitution": e},
            radius=[1.0, 0.5, 1.0],
            mass=[3.0, 1.5, 1.0],
            dt=duration(v) / steps,
            steps=6 * steps,
        )
        for v in SPEEDS
        for e in RESTITUTIONS
    ]
    found = []
    for one, result in zip(made, run(made), strict=True):
        after, before = by_id(result)["velocity"], one.particles.velocity
        assert result.state["position"][result.state["id"] == 2, 2] > 1
        found.append([(after[1] - after[0])[0] / (before[0] - before[1])[0], -after[2, 2] / before[2][2]])
    return np.array(found).reshape(len(SPEEDS), len(RESTITUTIONS), 2)


@pytest.mark.slow
def test_an_impact_has_the_restitution_at_any_speed():
    """Over three decades, between grains and at a wall; the error is first order in the step."""
    for steps in (25, 100, 400):
        found = restitutions(steps)
        np.testing.assert_allclose(found, np.broadcast_to(EXACT, found.shape), rtol=0, atol=0.2 / steps)
        # In its own units an impact is the same at any speed.
        assert np.ptp(found, axis=0).max() < 1e-9


def critically_damped(tau, speed):
    """Time (s), overlap (m) and approach speed (m/s) in an impact at a wall with e = 0, after Antypov and
    Elliott: x = delta^(5/4) is a damped oscillator in the time tau (m^(1/4) s), d tau = delta^(1/4) dt."""
    rate = (5 / 3 * E_STAR) ** 0.5

    def stretched(tau):
        return 1.25 * speed * tau * np.exp(-rate * tau)

    # Substitute tau = u^(5/4), because the integrand tau^(-1/5) diverges at 0.
    time, _ = quad(lambda u: 1.25 * u**0.25 * stretched(u**1.25) ** -0.2, 0, tau**0.8)
    return time, stretched(tau) ** 0.8, speed * (1 - rate * tau) * np.exp(-rate * tau)


@pytest.mark.slow
def test_without_restitution_a_grain_does_not_rebound():
    """At e = 0 damping is critical: the overlap decays to 0 as in Antypov and Elliott, at a wall and at
    another grain; the grains never separate."""
    speed, unit = 1.0, (5 / 3 * E_STAR) ** -0.5
    made = grains(
        [[0, 0, 1], [10, 0, 9], [12, 0, 9]], [[0, 0, -speed], [speed, 0, 0], [-speed, 0, 0]],
        planes=[FLOOR], law={"restitution": 0.0, "friction": 0.0}, mass=[1.0, 4.0, 4.0],
        radius=[1.0, 1.0, 1.0], dt=duration(speed) / 2000, steps=50_000,
    )  # fmt: skip
    simulation = compiled(made, WORLDS, CAPACITY)
    simulation.load([made])
    energies = [0.5 * speed**2]
    for parts in (0.3, 1.0, 2.0, 4.0):
        time, overlap, approach = critically_damped(parts * unit, speed)
        simulation.run(until=time)
        (result,) = simulation.results()
        state = by_id(result)
        assert 1 - state["position"][0, 2] == pytest.approx(overlap, rel=2e-3)
        assert -state["velocity"][0, 2] == pytest.approx(approach, abs=2e-3 * speed)
        energies.append(0.5 * approach**2 + 8 / 15 * E_STAR * (1 - state["position"][0, 2]) ** 2.5)
    assert (np.diff(energies) < 0).all()
    simulation.run()
    (result,) = simulation.results()
    state = by_id(result)
    assert np.abs(state["velocity"]).max() < 1e-4 * speed
    assert state["position"][0, 2] < 1
    assert np.diff(state["position"][1:, 0]) < 2


@pytest.mark.long
@pytest.mark.slow
def test_elastic_impacts_have_hertz_depth_and_duration():
    """After half its duration the grain is at rest, with the overlap and the force of the formulas."""
    errors = []
    for steps in (200, 400):
        made = grains([[0, 0, 1]], [[0, 0, -1]], planes=[FLOOR], law={"restitution": 1.0},
                      dt=duration(1.0) / steps, steps=2 * steps)  # fmt: skip
        simulation = compiled(made, WORLDS, CAPACITY)
        simulation.load([made])
        simulation.run(steps=steps // 2)
        most = simulation.s.read("force")[0, 0, 2] / (4 / 3 * E_STAR * depth(1.0) ** 1.5)
        (half,) = simulation.results()
        deepest, stands = 1 - half.state["position"][0, 2], half.state["velocity"][0, 2]
        simulation.run()
        (end,) = simulation.results()
        since = (end.state["position"][0, 2] - 1) / end.state["velocity"][0, 2]
        lasted = (end.time - since) / duration(1.0)
        errors.append(np.abs([most - 1, deepest / depth(1.0) - 1, stands, lasted - 1]))
    assert np.max(errors[1]) < 1e-4
    assert (errors[1] < errors[0] / 2).all() or np.max(errors[0]) < 1e-6


@pytest.mark.slow
def test_other_steppers_agree():
    """Boris with the same steps; and the implicit trapezoid, which starts with steps as long as the impact
    and shortens them during it. The impact is oblique, of a spinning grain, with friction and damping."""
    ends = []
    for stepper in (
        fixed(duration(1.0) / 100),
        Boris(control=FixedStep(dt=duration(1.0) / 100)),
        Trapezoid(control=IterationControl(first=duration(1.0), longest=duration(1.0))),
    ):
        made = grains(
            [[0, 0, 1]],
            [[0.7, 0, -1]],
            [[1, 2, 3]],
            planes=[FLOOR],
            law={"restitution": 0.6, "friction": 0.3},
            stepper=stepper,
            duration=3 * duration(1.0),
        )
        simulation = Simulation(made)
        simulation.load(made)
        simulation.run()
        (result,) = simulation.results()
        assert result.status.ok
        ends.append(np.concatenate([result.state["velocity"], result.state["spin"]]))
        simulation.close()
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=2e-3)
    np.testing.assert_allclose(ends[2], ends[0], rtol=0, atol=0.1)
    assert result.work["rejections"] > 2


def oblique(angles, **law):
    """Final states of grains that hit the floor at 1 m/s downwards, at angles (tangents) to the vertical."""
    made = [
        grains([[0, 0, 1]], [[tangent, 0, -1.0]], planes=[FLOOR], law=law, dt=duration(1.0) / 400, steps=600)
        for tangent in angles
    ]
    return [result.state for result in run(made)]


def test_a_sliding_impact_loses_mu_times_the_normal_impulse():
    """Delta v = mu (1 + e) v_n, and a spin of 5/2 of that over R, for any sliding speed."""
    angles, friction = (4.0, 8.0, 30.0), 0.2
    for tangent, state in zip(angles, oblique(angles, restitution=1.0, friction=friction), strict=True):
        loss = tangent - state["velocity"][0, 0]
        assert loss == pytest.approx(2 * friction, rel=1e-4)
        # The lever arm is R - delta / 2 at the depth of the impact.
        spin = 2.5 * loss * (1 - 0.5 * depth(1.0))
        assert state["spin"][0, 1] == pytest.approx(spin, rel=0.3 * depth(1.0))
        np.testing.assert_array_equal(state["spin"][0, [0, 2]], 0)


@pytest.mark.parametrize("friction", [0.1, 0.5, 5.0])
def test_friction_only_slows_the_surface(friction):
    """At any angle: the friction impulse is within Coulomb's limit, the surface speed does not reverse to a
    larger value, and energy does not grow. The gained spin is 5/2 of the lost velocity over the lever arm."""
    angles = np.tan(np.linspace(0.02, 1.5, 32))
    for tangent, state in zip(angles, oblique(angles, restitution=1.0, friction=friction), strict=True):
        loss, spin = tangent - state["velocity"][0, 0], state["spin"][0, 1]
        assert 0 < loss <= 2 * friction * (1 + 1e-4)
        assert spin == pytest.approx(2.5 * loss, abs=depth(1.0) * (1 + tangent))
        surface = state["velocity"][0, 0] - spin
        assert abs(surface) < tangent
        left = (state["velocity"] ** 2).sum() + 0.4 * (state["spin"] ** 2).sum()
        assert left <= (1 + tangent**2) * (1 + 1e-6)


@pytest.mark.long
def test_energy_never_grows(rng):
    """A thousand impacts of unlike spinning grains, a third of them grazing; e from 0.1 to 1, mu up to 3."""
    couples, made = CAPACITY // 2, []
    for k in range(WORLDS):
        radius, mass = rng.uniform(0.3, 1, (couples, 2)), rng.uniform(0.5, 2, (couples, 2))
        aside = np.where(rng.uniform(size=couples) < 0.3, 1 - 10 ** rng.uniform(-6, -2, couples),
                         rng.uniform(0, 1, couples))  # fmt: skip
        first = np.stack([100.0 * np.arange(couples), 0 * aside, 0 * aside], axis=1)
        normal = np.stack([0 * aside, aside, np.sqrt(1 - aside**2)], axis=1)
        second = first + radius.sum(axis=1)[:, None] * normal
        v, speed = np.zeros((couples, 2, 3)), 10 ** rng.uniform(0, 1, couples)
        v[:, 0, 2] = speed
        law = {"restitution": min(1.0, 0.1 + k / 30), "friction": rng.uniform(0, 1) if k % 4 else 3.0}
        made.append(
            grains(
                np.stack([first, second], axis=1).reshape(-1, 3),
                v.reshape(-1, 3),
                (rng.normal(size=(couples, 2, 3)) * speed[:, None, None]).reshape(-1, 3),
                planes=[AWAY],
                law=law,
                radius=radius.ravel(),
                mass=mass.ravel(),
                dt=duration(10.0, 0.15, 0.25) / 100,
                steps=1500,
            )
        )
    met = 0
    for result in run(made):
        before, after = (couple_energies(one) for one in (result.start, by_id(result)))
        met += (after != before).sum()
        assert (after <= before * (1 + 1e-5)).all()
    assert met > 1000


def couple_energies(state):
    """Energies of the pairs of consecutive grains, J."""
    inertia = 0.4 * state["mass"] * state["radius"] ** 2
    moving = state["mass"] * (state["velocity"] ** 2).sum(axis=1)
    return 0.5 * (moving + inertia * (state["spin"] ** 2).sum(axis=1)).reshape(-1, 2).sum(axis=1)
