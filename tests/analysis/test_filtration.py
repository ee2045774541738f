"""Breakthrough curves and captured fractions by size, compared with closed forms."""

import numpy as np
import pytest
from scipy import stats

from tisim import InputError
from tisim.analysis import (
    breakthrough_curve,
    captured_by_size,
    mean_core_radius,
    particle_balance,
)


def test_a_breakthrough_curve_of_a_filter_that_captures_half():
    """A step of the feed, of 1e5 particles in 10 s, of which half pass 2 s later; the curve is 1/2 while they
    do, and its intervals hold the true value in 19 of 20 bins."""
    rng = np.random.default_rng(1)
    passed = rng.random(100_000) < 0.5
    left = np.where(passed, 2.0 + rng.uniform(0.0, 10.0, 100_000), -1.0)
    curve = breakthrough_curve(left, np.arange(0.0, 14.25, 0.25), fed=100_000, feeding=10.0)
    middle = (curve.time[:-1] + curve.time[1:]) / 2
    during = (middle > 2) & (middle < 12)
    assert (curve.value[~during] == 0).all()
    assert (curve.low[~during] == 0).all()
    assert 0 < curve.high[~during].max() < 0.01
    assert curve.value[during].mean() == pytest.approx(passed.mean(), rel=1e-12)
    holds = (curve.low[during] <= 0.5) & (curve.high[during] >= 0.5)
    assert 35 <= holds.sum() <= 40
    assert curve.number.sum() == passed.sum()


def test_intervals_of_clopper_and_pearson():
    """2 of 10: by the binomial distribution, P(at least 2) at the lower end and P(at most 2) at the upper end
    are 2.5 %."""
    classes = captured_by_size(np.full(10, 1.0), np.arange(10) < 2, [0.5, 1.5, 2.0])
    assert (classes.number[0], classes.found[0], classes.value[0]) == (10, 2, 0.2)
    assert stats.binom.sf(1, 10, classes.low[0]) == pytest.approx(0.025, rel=1e-9)
    assert stats.binom.cdf(2, 10, classes.high[0]) == pytest.approx(0.025, rel=1e-9)
    # An empty class.
    assert np.isnan(classes.value[1])
    assert (classes.low[1], classes.high[1]) == (0.0, 1.0)
    ends = captured_by_size([1.0, 1.0, 3.0], [True, True, False], [0, 2, 4])
    np.testing.assert_array_equal(ends.value, [1.0, 0.0])
    assert ends.high[0] == 1.0
    assert ends.low[0] == pytest.approx(0.025**0.5)
    assert ends.low[1] == 0.0
    assert ends.high[1] == pytest.approx(0.975)


def test_captured_fractions_by_size():
    """The captured fraction of a particle grows as its radius; 95 % intervals hold it in most classes."""
    rng = np.random.default_rng(2)
    radius = rng.uniform(0.0, 1.0, 50_000)
    classes = captured_by_size(radius, rng.random(50_000) < radius, np.linspace(0.0, 1.0, 41))
    middle = (classes.edges[:-1] + classes.edges[1:]) / 2
    assert 36 <= ((classes.low <= middle) & (middle <= classes.high)).sum() <= 40
    assert np.abs(classes.value - middle).max() < 0.05


def test_the_mean_core_radius_is_that_of_the_sizes():
    radius = np.array([3e-9, 5e-9, 7e-9])
    mean = mean_core_radius(4.46e5 * 4 / 3 * np.pi * radius**3, 4.46e5)
    assert mean.value == pytest.approx(5e-9, rel=1e-14)
    assert mean.half == pytest.approx(4.302653 * 2e-9 / np.sqrt(3), rel=1e-6)


def test_a_balance_finds_a_missing_particle():
    state = {
        "mass": np.ones(5),
        "entered_at": np.array([0.0, 0.2, 0.4, 0.6, -1.0]),
        "entry_trials": np.array([0, 1, 2, 1, 3]),
        "exited_at": np.array([-1.0, 0.9, -1.0, -1.0, -1.0]),
        "captured_by": np.array([-1, -1, 3, -1, -1]),
    }
    work = {"entered": 3, "exited": 1, "captures": 2, "releases": 1}
    balance = particle_balance(work, state)
    assert (balance.given, balance.waiting, balance.captured, balance.free) == (1, 1, 1, 2)
    assert balance.missing == 0
    assert particle_balance({**work, "entered": 4}, state).missing == 1
    lost = {name: values[:3] for name, values in state.items()}
    assert particle_balance(work, lost).missing == 1
    bare = particle_balance({"captures": 1}, {"mass": np.ones(2), "captured_by": np.array([0, -1])})
    assert (bare.given, bare.captured, bare.free, bare.missing) == (2, 1, 1, 0)


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="edges must be at least two increasing numbers; received"):
        captured_by_size([1.0], [True], [2.0, 1.0])
    with pytest.raises(InputError, match=r"captured must be of shape \(2,\); received \(1,\)"):
        captured_by_size([1.0, 2.0], [True], [0.0, 3.0])
    with pytest.raises(InputError, match="fed must be at least 2; received 1"):
        breakthrough_curve([1.0, 2.0], [0.0, 3.0], fed=1, feeding=1.0)
    with pytest.raises(InputError, match="feeding must be above 0 s; received 0"):
        breakthrough_curve([1.0], [0.0, 3.0], fed=1, feeding=0.0)
