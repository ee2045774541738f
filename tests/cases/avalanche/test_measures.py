"""Angles, volumes and fillings of slopes whose grains lie on a lattice."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.cases.avalanche.slopes import WIDTH, block, leaning
from tisim.cases.avalanche.measures import (
    filled_parts,
    grains_volume,
    heap_volume,
    load_on_walls,
    repose,
    two_slopes,
)
from tisim.cases.avalanche.scene import DIAMETERS, GRAVITY

D = DIAMETERS[0]


@pytest.mark.parametrize(("run", "degrees"), [(1, 45.0), (2, 26.57)])
def test_a_staircase_has_the_angle_of_its_steps(run, degrees):
    assert repose(leaning(16, run)) == pytest.approx(degrees, abs=1.0)


def test_a_bent_slope_has_two_angles():
    heights = [*range(20, 10, -1), *(10 - k // 2 for k in range(20))]
    assert two_slopes(block(heights)) == pytest.approx((45.0, 26.57), abs=2.0)


def test_a_state_without_a_slope_has_no_angle():
    assert np.isnan(repose(block([5] * 10)))
    assert np.isnan(two_slopes(block([5] * 10))).all()


def test_the_volume_of_a_block_is_the_volume_of_its_box():
    state = block([4] * 8)
    assert heap_volume(state, WIDTH * D) == pytest.approx(4 * 8 * WIDTH * D**3)
    assert grains_volume(state) == pytest.approx(np.pi / 6 * 4 * 8 * WIDTH * D**3)
    # Grains that have left the cell through a periodic face count as inside.
    state["position"][::3, 1] += WIDTH * D
    assert heap_volume(state, WIDTH * D) == pytest.approx(4 * 8 * WIDTH * D**3)


def test_a_lattice_fills_pi_over_six():
    state = block([4] * 5)
    parts = filled_parts(state, WIDTH * D, 7 * D, 6 * D)
    assert parts.shape == (7, 6)
    np.testing.assert_allclose(parts[:5, :4], np.pi / 6, atol=0.025)
    assert not parts[5:].any()
    assert not parts[:, 4:].any()
    # Shifted by half a diameter across, over the periodic face.
    state["position"][:, 1] += D / 2
    np.testing.assert_allclose(filled_parts(state, WIDTH * D, 7 * D, 6 * D), parts, atol=1e-12)


def test_the_load_on_walls_is_counted_in_weights():
    state = {"mass": np.full(4, 0.5)}
    measures = {"box_force_z": -1.5 * GRAVITY, "gate_force_z": -0.5 * GRAVITY}
    assert load_on_walls(SimpleNamespace(state=state, measures=measures)) == pytest.approx(1.0)
