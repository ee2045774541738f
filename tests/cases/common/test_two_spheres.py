"""Closed forms of two spheres against quadrature and finite differences."""

import numpy as np
import pytest
from scipy.constants import mu_0
from scipy.integrate import quad

from tisim.cases.common.two_spheres import (
    HERTZ_DURATION,
    attraction_in_line,
    hertz_depth,
    hertz_force,
    hertz_overlap,
    reduced,
)


def test_the_attraction_is_the_slope_of_the_energy():
    """-mu_0 m^2 / (2 pi d^3), by a central difference."""
    energy = [-mu_0 * 0.3**2 / (2 * np.pi * d**3) for d in (0.7 - 1e-5, 0.7 + 1e-5)]
    assert attraction_in_line(0.3, 0.7) == pytest.approx((energy[1] - energy[0]) / 2e-5, rel=1e-6)


def test_hertz():
    """Energy in the contact and the duration by quadrature, and the overlap of a force."""
    radius, mass, modulus, speed = 2e-3, 3e-4, 5e8, 0.7
    depth = hertz_depth(speed, radius, mass, modulus)
    work = quad(lambda x: hertz_force(x, radius, modulus), 0, depth)[0]
    assert work == pytest.approx(mass * speed**2 / 2, rel=1e-12)
    # With x = 1 - y^2 the integrand has no pole at the turning point.
    slow = quad(lambda y: 2 * y / np.sqrt(1 - (1 - y**2) ** 2.5), 0, 1)[0]
    assert pytest.approx(2 * slow, rel=1e-9) == HERTZ_DURATION
    assert hertz_overlap(hertz_force(1e-5, radius, modulus), radius, modulus) == pytest.approx(1e-5)
    assert hertz_force(-1.0, radius, modulus) == 0
    assert reduced(3.0) == 3.0
    assert reduced(3.0, 6.0) == pytest.approx(2.0)
