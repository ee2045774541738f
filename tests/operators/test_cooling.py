"""Cooling: the law of Z04 (6.20), its implicit step, and the balance of heat."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.scenes import DENSITY, HEAT_CAPACITY, RADIUS, energy, scene, simulate
from tisim.effects import Heating, Impact
from tisim.operators import Cooling

SIGMA = 5.670374419e-8


THERMAL = (Impact(hardness=1e5), Heating(heat_capacity=HEAT_CAPACITY))


def run(scenes):
    return simulate(scenes, worlds=64, capacity=64)


def alone(temperature, dt, steps, cooling, radius=RADIUS):
    """A single grain at rest that cools or warms."""
    return scene(
        [[0, 0, 0]],
        [[0, 0, 0]],
        (*THERMAL, cooling),
        radius=radius,
        dt=dt,
        steps=steps,
        quantities={"temperature": temperature},
    )


LAW = Cooling(emissivity=0.7, surroundings=280.0, convection=40.0, gas=350.0)


def rate(t, radius=RADIUS):
    area, mass = 4 * np.pi * radius**2, DENSITY * 4 / 3 * np.pi * radius**3
    law = LAW
    flux = law.convection * (t - law.gas) + SIGMA * law.emissivity * (t**4 - law.surroundings**4)
    return -area * flux / (mass * HEAT_CAPACITY)


@pytest.mark.long
@pytest.mark.parametrize("temperature", [1800.0, 20.0])
def test_cooling_converges_at_first_order(temperature):
    """Compared with SciPy's integrator; half the step halves the error."""
    span = 5.0
    exact = solve_ivp(lambda _, t: rate(t), (0, span), [temperature], "DOP853", rtol=1e-12, atol=1e-9)
    steps = 2 ** np.arange(6, 12)
    results = run([alone(temperature, span / n, n, LAW) for n in steps])
    errors = np.array([abs(r.state["temperature"][0] - exact.y[0, -1]) for r in results])
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(1.0, abs=0.03)
    # The remainder after Richardson extrapolation is of second order, far below the error that it removes.
    better = 2 * results[-1].state["temperature"][0] - results[-2].state["temperature"][0]
    assert abs(better - exact.y[0, -1]) < errors[-1] / 100


def errors_of_steps():
    """Relative errors of T' = T + dt rate(T') after one step, with the root bracketed here and found by
    Newton's method in tisim."""
    draw = np.random.Generator(np.random.Philox(6))
    cases = [(float(t), 10.0**dt) for t in (0.0, 1e-3, 300.0, 3e3, 1e5) for dt in draw.uniform(-9, 2, 12)]
    errors = []
    for (t, dt), result in zip(cases, run([alone(t, dt, 1, LAW) for t, dt in cases]), strict=True):
        root = brentq(lambda x, t=t, dt=dt: x - t - dt * rate(x), 0, 2e5, xtol=1e-300, rtol=1e-15)
        errors.append(abs(float(result.state["temperature"][0]) / root - 1))
    return errors


def test_each_step_solves_its_implicit_equation():
    """From 0 K to 1e5 K; for f32 see test_precision."""
    assert max(errors_of_steps()) < 1e-13


def test_the_heat_balance_closes():
    for result in run([alone(t, 0.01, 50, LAW) for t in (0.0, 500.0, 1e5)]):
        assert energy(result.state) == pytest.approx(energy(result.start), rel=1e-13, abs=1e-13)


def test_cooling_never_crosses_equilibrium():
    """The explicit step of Z04 (6.21) would fall below absolute zero here."""
    law = Cooling(emissivity=1.0, surroundings=300.0)
    hot, cold = run([alone(t, 1e9, 1, law, radius=1e-8) for t in (1e5, 0.0)])
    assert hot.state["temperature"][0] == pytest.approx(300.0, rel=1e-9)
    assert cold.state["temperature"][0] == pytest.approx(300.0, rel=1e-9)
    assert hot.state["temperature"][0] >= 300.0 * (1 - 1e-9)


def test_surroundings_at_absolute_zero():
    """A grain at 0 K in surroundings at 0 K stays at 0 K; there is no 0/0."""
    law = Cooling(emissivity=1.0, surroundings=0.0, gas=0.0, convection=1.0)
    cold, warm = run([alone(t, 1.0, 1, law) for t in (0.0, 300.0)])
    assert cold.status.ok
    assert cold.state["temperature"][0] == 0.0
    assert 0 < warm.state["temperature"][0] < 300.0
