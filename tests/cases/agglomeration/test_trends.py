"""The four trends of Z04 remark 5.1 in flows of grains."""

import dataclasses

import numpy as np
import pytest

from tisim.analysis import Mean
from tisim.cases.agglomeration.scene import BEST, scene
from tisim.cases.agglomeration.trends import TRENDS, FoundTrend, study, table, trends_figure

GAMMA, HARDNESS, LENGTH, AREA = TRENDS


def power_law(trend, exponent, noise=0.0):
    rng = np.random.default_rng(1)
    x = np.array(trend.values)[:, None]
    sizes = 2.0 * x**exponent * np.exp(noise * rng.standard_normal((len(x), 12)))
    return FoundTrend(trend, sizes, np.full_like(sizes, 0.5))


def test_exponent_of_a_power_law():
    exact = power_law(HARDNESS, -0.3)
    assert exact.exponent.value == pytest.approx(-0.3, rel=1e-12)
    assert exact.seen
    noisy = power_law(HARDNESS, -0.3, 0.05).exponent
    assert abs(noisy.value + 0.3) < 2 * noisy.half < 0.1


@pytest.mark.parametrize(("exponent", "noise"), [(0.3, 0.01), (0.0, 0.3)])
def test_the_wrong_sign_or_noise_is_not_seen(exponent, noise):
    assert not power_law(HARDNESS, exponent, noise).seen
    assert power_law(GAMMA, 0.3, 0.01).seen


def test_signs_are_those_of_the_critical_size():
    """b_0 = 4 gamma/(H a_f beta) (5.5)."""
    assert [trend.exponent for trend in TRENDS] == [1, -1, -1, -1]


def test_each_parameter_is_in_the_scene():
    base = scene(BEST, 0, 10)
    for trend in TRENDS:
        changed = base.replace({trend.key: trend.values[0]})
        assert changed != base.replace({trend.key: trend.values[-1]})


def test_a_study_of_few_starts_is_drawn_and_tabulated():
    """Grains that break at any impact stay small; grains that never break grow."""
    ends = dataclasses.replace(GAMMA, values=(1e1, 1e6))
    (found,) = study(30, range(3), trends=(ends,))
    assert found.sizes.shape == (2, 3)
    assert (found.sizes[0] < 1.1).all()
    assert (found.sizes[1] > 1.2).all()
    assert found.broken[1].max() == 0
    assert found.seen
    assert f"| {found.means[0]} | {found.means[1]} | {found.exponent} | +1 | yes |" in table([found])
    top, below = trends_figure([found]).axes
    np.testing.assert_allclose(top.lines[0].get_ydata(orig=False), [one.value for one in found.means])
    np.testing.assert_allclose(
        below.lines[0].get_ydata(orig=False), [Mean.of(one).value for one in found.broken]
    )  # fmt: skip


@pytest.mark.slow
def test_all_four_trends_are_seen():
    """Each confidence interval of the exponent has the published sign, and each step is in its direction."""
    for found in study(100, range(24)):
        assert found.seen, found.trend.statement
        steps = found.trend.exponent * np.diff([one.value for one in found.means])
        assert (steps > -0.02).all(), found.trend.statement
        assert abs(found.exponent.value) < 0.5
