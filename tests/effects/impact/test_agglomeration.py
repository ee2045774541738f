"""Two grains that bond merge into one sphere and conserve all quantities."""

import numpy as np
import pytest

from tests.scenes import RADIUS, SOFT, energy, head_on, laws, momentum, scene, simulate
from tisim.effects import Impact


def run(scenes):
    return simulate(scenes, worlds=64, capacity=64)


def pair(rng):
    radii = RADIUS * rng.uniform(0.3, 3, 2)
    n = rng.normal(size=3)
    n /= np.linalg.norm(n)
    v = rng.normal(size=3) * 100
    return scene(
        [[0, 0, 0], radii.sum() * (1 - 1e-6) * n],
        [v, v - 3 * n + rng.normal(size=3) * 0.1],
        laws(),
        radius=radii,
        quantities={"temperature": rng.uniform(100, 1000, 2)},
    )


@pytest.mark.long
def test_two_bonded_grains_become_one_sphere(rng):
    """Mass, momentum, volume, energy and centre of mass equal the sums over both; one particle is left."""
    for result in run([pair(rng) for _ in range(60)]):
        start, one = result.start, result.state
        assert len(one["mass"]) == result.work["merges"] == result.work["bonds"] == 1
        assert one["mass"][0] == pytest.approx(start["mass"].sum(), rel=2e-16)
        assert (one["radius"] ** 3)[0] == pytest.approx((start["radius"] ** 3).sum(), rel=1e-15)
        total = (start["mass"][:, None] * start["velocity"]).sum(axis=0)
        size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
        np.testing.assert_allclose(momentum(one), total, rtol=0, atol=4e-16 * size)
        moved = start["position"] + 1e-9 * start["velocity"]
        centre = (start["mass"][:, None] * moved).sum(axis=0) / start["mass"].sum()
        np.testing.assert_allclose(one["position"][0], centre, rtol=0, atol=1e-18)
        assert energy(one) == pytest.approx(energy(start), rel=1e-14)
        # Friction makes no difference: a bonded pair has no slip left.
        assert one["temperature"][0] > (start["mass"] @ start["temperature"]) / start["mass"].sum()


@pytest.mark.long
def test_bonded_grains_stay_separate_without_merging():
    """Without the effect a bond is counted, both grains move on together, and both remain."""
    (result,) = simulate([head_on(5.0, (Impact(hardness=SOFT),), mass=[1.0, 3.0])], worlds=300, capacity=2)
    assert result.work["bonds"] == 1
    np.testing.assert_allclose(result.state["velocity"], [[-2.5, 0, 0]] * 2, rtol=1e-15)
