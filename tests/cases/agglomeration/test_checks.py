"""Checks of Z04's closed forms."""

import numpy as np
import pytest
from scipy.constants import G

from tisim.cases.agglomeration.checks import (
    DENSITY,
    HARDNESS,
    pressed_by_gravity,
    self_gravity_radius,
)


def test_the_radius_from_which_self_gravity_bonds():
    """Z04 (4.16): the paper says several kilometres for its ranges of hardness and density."""
    radius = self_gravity_radius(HARDNESS, DENSITY)
    mass = DENSITY * 4 / 3 * np.pi * radius**3
    assert G * mass**2 / (2 * radius) ** 2 == pytest.approx(2 * HARDNESS * np.pi * radius**2, rel=1e-12)
    assert pressed_by_gravity(radius) == pytest.approx(1.0, rel=1e-12)
    assert pressed_by_gravity(2 * radius) == pytest.approx(4.0, rel=1e-12)
    assert self_gravity_radius(1e5, 1e4) == pytest.approx(4.6e3, rel=0.02)
    assert self_gravity_radius(1e6, 1e3) == pytest.approx(146e3, rel=0.01)
