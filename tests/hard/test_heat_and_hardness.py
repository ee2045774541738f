"""Strong coupling of heat, hardness and restitution: the iteration converges and nothing overflows."""

import numpy as np
import pytest
from scipy.constants import R

from tests.scenes import DENSITY, HEAT_CAPACITY, energy, head_on, hit, simulate
from tisim.effects import DeformationWork, Friction, Heating, Impact, Reaction, Softening


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
