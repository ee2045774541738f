"""Means over runs, and their intervals."""

import numpy as np
import pytest

from tisim import InputError
from tisim.analysis import Mean


def test_mean_and_its_interval():
    # Student's t for 3 degrees of freedom is 3.18245; the standard error of 1, 2, 3, 4 is sqrt(5/12).
    mean = Mean.of([1.0, 2.0, 3.0, 4.0])
    assert mean.value == 2.5
    assert mean.half == pytest.approx(3.182446 * np.sqrt(5 / 12), rel=1e-6)
    # The error of a ratio, against random samples.
    rng = np.random.default_rng(0)
    a, b = rng.normal(4.0, 0.1, 200_000), rng.normal(2.0, 0.03, 200_000)
    assert Mean(4.0, 0.1).over(Mean(2.0, 0.03)).half == pytest.approx((a / b).std(), rel=0.02)
    apart = Mean(4.0, 0.1).minus(Mean(2.0, 0.03))
    assert (apart.value, apart.half) == (2.0, pytest.approx((a - b).std(), rel=0.02))


@pytest.mark.parametrize(
    ("value", "half", "shown"),
    [
        (0.48314, 0.0823, "0.483 ± 0.082"), (2.4462, 0.0823, "2.446 ± 0.082"), (-1711.3, 24.6, "-1711 ± 25"),
        (0.016, 0.018, "0.016 ± 0.018"), (0.01234, 3.21, "0.0 ± 3.2"), (0.0, 0.5, "0.00 ± 0.50"),
        (966.7, 143.4, "970 ± 140"), (0.5, 0.1, "0.50 ± 0.10"), (2.4462e-9, 8.23e-11, "2.446e-09 ± 8.2e-11"),
        (3.2e-9, 8.2e7, "3e-09 ± 8.2e+07"), (0.0, 8.23e-11, "0 ± 8.2e-11"), (1.0, 0.0996, "1.00 ± 0.10"),
        (12.3, 9.96, "12 ± 10"),
        (1.23456, 0.0, "1.235 ± 0"), (1.23456, np.nan, "1.235 ± nan"), (np.nan, np.nan, "nan ± nan"),
        (1.0, np.inf, "1 ± inf"),
    ],
)  # fmt: skip
def test_a_mean_has_no_more_digits_than_its_interval(value, half, shown):
    assert str(Mean(value, half)) == shown


@pytest.mark.parametrize(
    "runs", [[], [1.0, np.nan], [[1.0, 2.0], [3.0, 4.0]], [np.inf, 1.0], ["a"], [[1.0], [2.0, 3.0]]]
)
def test_anything_but_numbers_is_refused(runs):
    with pytest.raises(InputError, match="runs must be a list of finite numbers, one for each run; received"):
        Mean.of(runs)


def test_a_single_run_has_no_interval():
    assert Mean.of([2.0]) == Mean(2.0, np.inf)
