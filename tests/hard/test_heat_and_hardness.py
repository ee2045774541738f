"""Strong coupling of heat, hardness and restitution: the iteration converges and nothing overflows."""

import numpy as np
import pytest
from scipy.constants import R

from tests.engine.test_schedules import BATCH
from tests.scenes import DENSITY, HEAT_CAPACITY, energy, flow, head_on, hit, simulate
from tisim.effects import DeformationWork, Friction, Heating, Impact, Reaction, Softening


def flip_flop(a0=0.0, af=1.0, pressure=0.5, iterations=200):
    """Fixed-point iteration of Z04: e_(K+1) = max(1 - I_n / (2 a(e_K) H), 0) from e = 0, at constant
    hardness."""
    e, history = 0.0, []
    for _ in range(iterations):
        e = max(1 - pressure / (a0 + (af - a0) * (1 - e)) if (1 - e) * (af - a0) + a0 > 0 else 0.0, 0.0)
        history.append(e)
    return np.array(history)


@pytest.mark.slow
def test_the_iteration_of_the_paper_never_converges_and_ours_does():
    """The iteration x = 1 - e -> p / x alternates between 1 and p for ever; tisim finds e = 1 - sqrt(p)."""
    history = flip_flop(pressure=0.5)
    assert np.ptp(history[-2:]) == pytest.approx(0.5), "bond, rebound, bond, ..."
    hardness, speed = 1e6, 0.0
    speed = np.sqrt(0.5 * 3 * hardness / (2 * DENSITY))
    (result,) = simulate([head_on(speed, (Impact(hardness=hardness),))], worlds=300, capacity=2)
    v = result.state["velocity"][:, 0]
    assert (v[1] - v[0]) / (2 * speed) == pytest.approx(1 - np.sqrt(0.5), abs=1e-9)


def coupled(speed, iterations=200, q=3000.0, alpha=3e4, c=HEAT_CAPACITY, **more):
    """Strong coupling of heat and hardness: near the adhesion speed hot grains are soft and soft grains get
    hot."""
    effects = (
        Impact(hardness=1e5, max_iterations=iterations, **more),
        Friction(coefficient=0.9),
        Heating(heat_capacity=c),
        DeformationWork(),
        Softening(activation_energy=q),
        Reaction(energy_density=alpha),
    )
    return hit(speed, effects)


@pytest.mark.slow
def test_iterations_across_the_bond_threshold_converge():
    """In a fine scan of speeds through the threshold each impact converges within the iteration bound."""
    speeds = np.linspace(1.0, 40.0, 300)
    results = simulate([coupled(v) for v in speeds], worlds=300, capacity=2)
    e = []
    for v, result in zip(speeds, results, strict=True):
        assert result.work["unconverged"] == 0
        assert 1 <= result.work["iterations"] <= 200
        u = result.state["velocity"][:, 0]
        e.append((u[1] - u[0]) / (2 * v))
    bonds = np.array([result.work["bonds"] for result in results])
    assert 0 < bonds.sum() < 300, "the scan must cross the threshold"
    assert (np.diff(bonds) >= 0).all(), "it bonds from one speed on, once and for all"
    assert (np.diff(e) <= 1e-9).all()


@pytest.mark.slow
def test_unconverged_impacts_are_bounded_and_counted():
    """With too few iterations allowed the run continues with the bounded result and reports it."""
    results = simulate(
        [coupled(v, iterations=2, tolerance=1e-15) for v in (3.0, 5.0, 8.0)], worlds=3, capacity=2
    )
    for result in results:
        assert result.status.ok
        assert result.work["iterations"] <= 2
        assert energy(result.state) == pytest.approx(energy(result.start), rel=1e-13)
    assert sum(result.work["unconverged"] for result in results) >= 1


@pytest.mark.long
@pytest.mark.parametrize("temperature", [0.0, 1e-30, 1e-3, 1.0, 1e6, 1e9])
def test_extreme_temperatures(temperature):
    """exp(Q / (R T)) overflows below 0.4 K and T^4 is 1e36 at 1e9 K; balances close and all numbers stay
    finite."""
    scene = flow(seed=8, grains=60, hardness=1e5, duration=2e-4)
    data = scene.to_dict()
    data["particles"]["quantities"]["temperature"] = temperature
    (result,) = simulate([type(scene).from_dict(data)], worlds=BATCH, capacity=200, schedule="world")
    assert result.status.ok, result.status.reason
    assert all(np.isfinite(values).all() for values in result.state.values())
    assert (result.state["temperature"] >= 0).all()
    assert energy(result.state) == pytest.approx(energy(result.start), rel=1e-11)
    assert result.work["impacts"] > 10
    assert result.work["unconverged"] == 0


@pytest.mark.slow
def test_cold_grains_are_hard_and_hot_ones_as_hard_as_h0():
    """At 1 mK grains that bond at room temperature do not bond; at 1e9 K the hardness is H_0."""
    q = 1000.0
    speed = 0.5 * np.sqrt(3 * 1e5 * np.exp(q / R / 300) / (2 * DENSITY))
    effects = (Impact(hardness=1e5), Heating(heat_capacity=1e12), Softening(activation_energy=q))
    # The heat capacity is so large that the impact does not change the temperature.
    e = []
    for result in simulate(
        [head_on(speed, effects, dt=1e-15, quantities={"temperature": t}) for t in (1e-3, 300.0, 1e9)],
        worlds=300,
        capacity=2,
    ):
        v = result.state["velocity"][:, 0]
        e.append((v[1] - v[0]) / (2 * speed))
    hot = np.sqrt(3 * 1e5 / (2 * DENSITY))
    np.testing.assert_allclose(e, [1.0, 0.5, 1 - speed / hot], atol=1e-9)
