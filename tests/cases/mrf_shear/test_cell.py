"""Runs of a small cell: chains form, rafts are frozen and driven, and the stress is as expected."""

import numpy as np
import pytest

from tests.scenes import simulate
from tisim.cases.common.runs import overlap
from tisim.cases.mrf_shear.measures import order, raft_force, shear_rate, shear_stress
from tisim.cases.mrf_shear.scene import LOWER, UPPER, scene

UM = 1e-6
SMALL_CELL = {"sides": (30 * UM, 30 * UM, 36 * UM), "raft": 7 * UM, "rate": 1e4, "magnetising": 10e-6,
              "strain": 0.4, "before": 0.2}  # fmt: skip
"""A cell with a width of twice the interaction range of grains and a height of five diameters."""
STARTS = 4
"""Number of starts: the stress of one run has a standard deviation of 15 %."""


@pytest.fixture(scope="module")
def results():
    """Runs at full field, half field, no field, and no field with oil at rest; then further starts of the
    first two."""
    further = [scene(**SMALL_CELL, **flux, seed=k) for flux in ({}, {"flux": 0.3}) for k in range(1, STARTS)]
    scenes = [scene(**SMALL_CELL), scene(**SMALL_CELL, flux=0.3), scene(**SMALL_CELL, flux=0.0)]
    scenes.append(scene(**SMALL_CELL, flux=0.0, still=True))
    return simulate([*scenes, *further], worlds=len(scenes) + len(further), capacity=128)


@pytest.mark.slow
def test_rafts_are_frozen_and_driven_apart(results):
    result = results[0]
    state = result.state
    assert result.status.ok
    rafts = [state["group"] == group for group in (LOWER, UPPER)]
    assert result.work["joined"] == sum(int(raft.sum()) for raft in rafts)
    speed = 1e4 * 22 * UM / 2
    for raft, sign in zip(rafts, (-1, 1), strict=True):
        assert raft.sum() > 5
        np.testing.assert_allclose(state["velocity"][raft], [[sign * speed, 0, 0]] * raft.sum(), rtol=1e-9)
    assert shear_rate(result) == pytest.approx(1e4)


@pytest.mark.slow
def test_the_stress_of_chains_is_proportional_to_the_squared_field(results):
    """Grains touch along the field and resist both rafts equally; without a field there is no stress."""
    stresses = [shear_stress(result) for result in results]
    none, still = stresses[2:4]
    strong = np.mean([stresses[0], *stresses[4 : 3 + STARTS]])
    weak = np.mean([stresses[1], *stresses[3 + STARTS :]])
    assert strong > 10e3
    assert 2.5 < strong / weak < 6.0
    assert abs(none) < 0.02 * strong
    # The drag of oil at rest on the rafts does not count as a stress either.
    assert abs(still) < 0.02 * strong
    back, on = (raft_force(results[0], group)[0] for group in (LOWER, UPPER))
    assert back == pytest.approx(-on, rel=0.15)
    chains = order(results[0].state, results[0].scene.domain)
    assert chains.alignment > 0.1
    assert chains.contacts > 2.5
    assert 0.02 < overlap(results[0]) < 0.12
