"""Extreme cases of charged particles with other steppers than the hard cases have: long rotation, long steps,
drift, release, and time reversal."""

import numpy as np
import pytest

from tests.hard.judging import holds
from tests.scenes import simulate
from tisim.cases.hard.gyration import (
    GYRATION,
    charges,
    drift_across_both_fields,
    equal_steps,
    reversed_time,
    ten_thousand_gyrations,
)
from tisim.cases.hard.singular import electrons_from_a_nanometre
from tisim.steppers import Collocation, StageControl

OTHERS = ["trapezoid", pytest.param("collocation", marks=pytest.mark.slow)]


@pytest.mark.long
@pytest.mark.parametrize("method", OTHERS)
@pytest.mark.parametrize("case", [reversed_time, ten_thousand_gyrations, drift_across_both_fields])
def test_other_methods_keep_the_bounds(case, method):
    holds(case, method)


@pytest.mark.slow
def test_sweeps_that_do_not_converge_fail_clearly():
    """Five stages at w dt = 20 give a failure that keeps the start state, not a wrong number."""
    setup = charges([[0, 0, 0]], [[0.6, -0.8, 0.5]], equal_steps("collocation", 20.0 / GYRATION), 100.0)
    (result,) = simulate([setup], worlds=1, capacity=2)
    assert "cannot be solved even at the shortest step, by effects.lorentz" in result.status.reason
    np.testing.assert_array_equal(result.state["velocity"], result.start["velocity"])


@pytest.mark.slow
def test_like_charges_from_a_nanometre_by_collocation():
    """The energy is right to 1e-8."""
    speed, *_ = outcomes = electrons_from_a_nanometre.run(
        lambda first: Collocation(
            control=StageControl(error=1e-9, sweeps=40, first=first, longest=1e-3, shortest=1e-22)
        )
    )
    assert all(one.ok for one in outcomes)
    assert speed.number < 1e-8
