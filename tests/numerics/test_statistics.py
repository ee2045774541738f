"""Student's confidence interval of a mean."""

import numpy as np
import pytest

from tisim.numerics.statistics import half_width


def test_published_quantiles():
    # NIST/SEMATECH e-Handbook 1.3.6.7.2, two-sided 95 %, for 1, 3 and 11 degrees of freedom.
    for t, values in ((12.706, [0.0, 2.0]), (3.182, [1.0, 2.0, 3.0, 4.0]), (2.201, range(12))):
        error = np.std(values, ddof=1) / np.sqrt(len(values))
        assert half_width(values) == pytest.approx(t * error, rel=3e-4)
    assert half_width([0.0, 2.0], 0.5) == pytest.approx(1.0)  # t_1 = tan(pi/4)


def test_the_interval_has_its_nominal_coverage():
    runs = np.random.default_rng(5).normal(3.0, 2.0, (6, 4000))
    assert (np.abs(runs.mean(axis=0) - 3.0) < half_width(runs)).mean() == pytest.approx(0.95, abs=0.012)


def test_a_single_run_has_no_interval():
    assert half_width([1.0]) == np.inf
