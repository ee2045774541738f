"""The viscosity without field: limits of the packing model and of the law of Krieger and Dougherty."""

import numpy as np
import pytest

from tisim.cases.mrf_shear.off_state import (
    RANDOM_PACKING,
    closest_packing,
    off_state_viscosity,
    relative_viscosity,
)
from tisim.cases.mrf_shear.published import OIL_VISCOSITY

BETA = RANDOM_PACKING


def test_of_one_size_it_is_a_random_packing():
    assert closest_packing([3.0], [1.0]) == BETA
    assert closest_packing([3.0, 1.0], [1.0, 0.0]) == BETA
    # Two classes of all but one size are one class.
    assert closest_packing([1.0, 0.999], [0.5, 0.5]) == pytest.approx(BETA, rel=0.03)


def test_much_smaller_grains_fill_holes_as_furnas_has_it():
    """Small ones in the holes of large ones, or large ones as islands among small ones."""
    for small in (0.1, 0.26, 0.5):
        filled, islands = BETA / (1 - small), BETA / (1 - (1 - BETA) * (1 - small))
        expected = min(filled, islands)
        assert closest_packing([1.0, 1e-6], [1 - small, small]) == pytest.approx(expected, rel=2e-3)


def test_the_densest_mixture_has_a_quarter_to_a_third_of_small_grains():
    parts = np.linspace(0.0, 1.0, 101)
    packed = np.array([closest_packing([1.0, 0.25], [1 - y, y]) for y in parts])
    assert packed.min() == BETA
    assert 0.25 < parts[packed.argmax()] < 0.4
    # Which of the two classes comes first is all one.
    assert closest_packing([0.25, 1.0], [0.3, 0.7]) == closest_packing([1.0, 0.25], [0.7, 0.3])


def test_few_grains_thicken_as_einstein_has_it_and_many_without_bound():
    for fraction in (1e-6, 1e-5):
        assert relative_viscosity(fraction, 0.64) - 1 == pytest.approx(2.5 * fraction, rel=1e-4)
    assert relative_viscosity(0.64, 0.64) == relative_viscosity(0.7, 0.64) == np.inf
    assert relative_viscosity(0.32, 0.64) == pytest.approx(2**1.6)
    thick = off_state_viscosity(0.3, [1.0, 0.25], [1.0, 0.0])
    assert thick == pytest.approx(OIL_VISCOSITY * relative_viscosity(0.3, BETA))
    assert off_state_viscosity(0.3, [1.0, 0.25], [0.67, 0.33]) < thick
