"""The force of two dipoles in line is the slope of their energy."""

import numpy as np
import pytest
from scipy.constants import mu_0

from tisim.cases.dipoles import attraction_in_line


def test_the_attraction_is_the_slope_of_the_energy():
    """-mu_0 m^2 / (2 pi d^3), by a central difference."""
    energy = [-mu_0 * 0.3**2 / (2 * np.pi * d**3) for d in (0.7 - 1e-5, 0.7 + 1e-5)]
    assert attraction_in_line(0.3, 0.7) == pytest.approx((energy[1] - energy[0]) / 2e-5, rel=1e-6)
