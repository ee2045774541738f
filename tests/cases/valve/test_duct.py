"""The flow without a field, against Poiseuille in a pipe and quadrature along cones."""

import numpy as np
import pytest
from scipy.integrate import quad

from tisim.cases.common.magnetorheological_fluid import RANDOM_PACKING, relative_viscosity
from tisim.cases.valve.duct import Duct, open_flow, resistance, suspension_viscosity


def test_flow_in_a_pipe_agrees_with_poiseuille():
    pipe = Duct(throat=1e-3 * (1 - 1e-9), bore=1e-3, straight=2e-3, taper=1e-3, length=9e-3)
    assert resistance(pipe) == pytest.approx(128 * 9e-3 / (np.pi * 1e-12), rel=1e-7)
    expected = 1e5 * np.pi * 1e-12 / (128 * suspension_viscosity(0.345) * 9e-3)
    assert open_flow(pipe, 1e5, 0.345) == pytest.approx(expected, rel=1e-7)


def test_flow_in_cones_agrees_with_quadrature():
    duct = Duct(throat=0.4, bore=1.3, straight=0.2, taper=0.7, length=4.0)
    heights, radii = duct.profile()
    along = quad(lambda z: np.interp(z, heights, radii) ** -4, 0, 4, points=heights[1:-1])[0]
    assert resistance(duct) == pytest.approx(8 / np.pi * along, rel=1e-6)


def test_the_suspension_is_thicker_than_its_oil():
    assert suspension_viscosity(0.0) == pytest.approx(0.16)
    assert suspension_viscosity(0.345) == pytest.approx(0.16 * relative_viscosity(0.345, RANDOM_PACKING))
