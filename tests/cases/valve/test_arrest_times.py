"""Times to arrest by pressure: medians with censored starts, the trend, and the text and picture of made-up
valves."""

import numpy as np
import pytest

from tests.cases.valve.test_opens import UM, made_up, opening
from tisim.cases.valve.arrest_times import (
    PRESSURES,
    Pressed,
    by_pressure,
    median_text,
    picture,
    report,
    trend,
)
from tisim.cases.valve.opens import NOMINAL


def pressed(times, pressure=NOMINAL, width=4.0):
    """A valve whose starts are arrested at times (µs); NaN is a start that is not arrested."""
    starts = [opening(0.5, 0.5) if np.isnan(t) else opening(0.0, 0.5, arrested_at=t * UM) for t in times]
    return Pressed(width, pressure, starts)


def test_starts_that_are_not_arrested_are_longer_than_all_times():
    one = pressed([100.0, np.nan, 180.0])
    assert np.isinf(one.times).tolist() == [False, True, False]
    assert one.times[2] - one.times[0] == pytest.approx(80 * UM)
    assert (one.arrested.found, one.arrested.starts) == (2, 3)
    assert one.left.value == pytest.approx((0.0 + 0.5 + 0.0) / 3)


def test_the_interval_of_a_median_of_twelve_ends_at_the_third_and_the_tenth():
    """P(B <= 2) = 0.019 for a binomial B of 12 and 1/2, and P(B <= 3) = 0.073."""
    one = pressed([60.0 + 20 * k for k in range(12)])
    middle, low, high = one.median
    assert (low, high) == (one.times[2], one.times[9])
    assert middle == pytest.approx((one.times[5] + one.times[6]) / 2)
    _, low, high = pressed([*[100.0] * 7, *[np.nan] * 5]).median
    assert np.isfinite(low)
    assert np.isinf(high)
    middle, low, _ = pressed([*[100.0] * 3, *[np.nan] * 9]).median
    assert np.isinf(middle)
    assert np.isfinite(low)


def test_the_interval_of_a_median_contains_it_at_the_nominal_level(rng):
    """Of 4000 samples of 12 from a skewed law with the median log 2."""
    draws = np.sort(rng.exponential(size=(4000, 12)))
    held = np.mean((draws[:, 2] <= np.log(2)) & (np.log(2) <= draws[:, 9]))
    assert held == pytest.approx(0.961, abs=0.012)


def test_a_trend_needs_times_that_rise_with_the_pressure():
    rising = [pressed([100.0 + 30 * k + j for j in range(6)]) for k in range(4)]
    assert trend(rising) < 1e-4
    assert trend(rising[::-1]) > 0.99
    # Failures at the highest pressures also count as longer times.
    failing = [pressed([100.0] * 6), pressed([100.0] * 6), pressed([np.nan] * 6)]
    assert trend(failing) < 0.01


def test_valves_run_at_each_pressure_from_the_same_starts(monkeypatch):
    made = []
    monkeypatch.setattr(
        "tisim.cases.valve.opens.flows", lambda scenes, progress: made.extend(scenes) or made_up(scenes)
    )
    found = by_pressure(2, widths=(4.0, 5.0), pressures=PRESSURES[1:3])
    assert [(one.width, one.pressure) for one in found] == [
        (width, pressure) for width in (4.0, 5.0) for pressure in PRESSURES[1:3]
    ]
    assert [one.seed for one in made] == [0, 1] * 4
    speeds = [one.effects[5].speed for one in made[::2]]
    assert speeds[1] / speeds[0] == pytest.approx(2.0)
    assert speeds[3] / speeds[2] == pytest.approx(2.0)
    throats = [2 * one.effects[4].cylinders[1].radius for one in made[::2]]
    assert throats == pytest.approx([176 * UM] * 2 + [220 * UM] * 2)


def test_the_text_and_the_picture_of_valves():
    found = [
        pressed([100.0 + 10 * width * factor] * 5 + [np.nan] * int(factor), factor * NOMINAL, width)
        for width in (4.0, 5.0)
        for factor in (1.0, 2.0, 4.0)
    ]
    # The starts of all pressures are the same.
    found = [Pressed(one.width, one.pressure, one.starts[-6:]) for one in found]
    text = report(found).splitlines()
    assert len(text) == 1 + 2 * 4
    assert text[1].startswith("  4 grains, 39.1 kPa: arrested 5 of 6 (0.36 to 1.00), median ")
    assert text[2].startswith("  4 grains, 78.2 kPa: arrested 4 of 6 (0.22 to 0.96), median ")
    assert "to > 400), 0.17" in text[2]
    # Four of six starts are not arrested, and a median of six has the interval from the first to the sixth.
    assert "median > 400 µs (" in text[3]
    assert median_text(pressed([np.nan] * 6)) == "> 400 µs"
    fractions, times = picture(found).axes
    assert [text.get_text() for text in fractions.get_xticklabels()] == ["39", "78", "156"]
    heights = [line.get_ydata() for line in times.lines if len(line.get_ydata()) == 6]
    assert [int((one > 400).sum()) for one in heights] == [1, 2, 4, 1, 2, 4]
