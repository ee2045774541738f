"""L21's mixtures have the printed sizes, and the viscosity without a field has the known limits."""

import numpy as np
import pytest

from tisim.cases.common import magnetorheological_fluid as mixtures
from tisim.cases.common.magnetorheological_fluid import RANDOM_PACKING, closest_packing, relative_viscosity
from tisim.packing.grains import draw, masses

BETA = RANDOM_PACKING


def numbers(parts):
    diameter, part = np.array(parts).T
    return diameter * 1e-6, part / part.sum()


@pytest.mark.parametrize(
    ("parts", "median"), [(mixtures.SMALL_GRAINS, 1.8e-6), (mixtures.LARGE_GRAINS, 6.7e-6)]
)
def test_curves_are_whole_and_have_the_medians_that_are_printed(parts, median):
    diameter, part = np.array(parts).T
    assert part.sum() == pytest.approx(1.0, abs=2e-4)
    half = np.interp(0.5, np.cumsum(part) / part.sum(), diameter * 1e-6)
    assert half == pytest.approx(median, rel=0.01)


@pytest.mark.parametrize("by", ["number", "mass"])
def test_grains_are_drawn_by_number_or_by_mass(by):
    """Among 100 000 grains each size has the number or the mass fraction in the table."""
    made = mixtures.classes(mixtures.LARGE_GRAINS, by)
    which, radius = draw(made, 100_000, seed=3)
    weight = np.ones(len(radius)) if by == "number" else masses(made, which, radius)
    found = np.bincount(which, weight, minlength=len(made)) / weight.sum()
    diameter, part = numbers(mixtures.LARGE_GRAINS)
    np.testing.assert_allclose(2 * np.array([one.sizes.radius for one in made]), diameter)
    # A single large grain may be a large part of the mass.
    np.testing.assert_allclose(found, part, atol=0.005 if by == "number" else 0.02)


def test_a_mixture_has_its_part_of_small_grains_by_mass():
    made = mixtures.magnetorheological(0.33)
    which, radius = draw(made, 400_000, seed=4)
    mass = masses(made, which, radius)
    assert mass[which < len(mixtures.SMALL_GRAINS)].sum() / mass.sum() == pytest.approx(0.33, abs=0.02)
    assert mixtures.magnetorheological(0.0) == mixtures.classes(mixtures.LARGE_GRAINS, "number")


def test_valve_grains_are_parts_of_the_mass():
    for parts, largest in ((mixtures.VALVE_GRAINS, 44e-6), (mixtures.FINE_VALVE_GRAINS, 10e-6)):
        made = mixtures.classes(parts, "mass")
        assert sum(one.share for one in made) == pytest.approx(1.0)
        assert made[0].sizes.radius == pytest.approx(largest / 2)
        assert made[0].share == pytest.approx(44 / 122)


def test_a_fluid_of_one_size_is_a_random_packing():
    assert closest_packing([3.0], [1.0]) == BETA
    assert closest_packing([3.0, 1.0], [1.0, 0.0]) == BETA
    # Two classes of nearly equal size are as one class.
    assert closest_packing([1.0, 0.999], [0.5, 0.5]) == pytest.approx(BETA, rel=0.03)


def test_much_smaller_grains_fill_holes_by_furnas():
    """Small grains fill the holes between large ones, or large grains are islands among small ones."""
    for small in (0.1, 0.26, 0.5):
        filled, islands = BETA / (1 - small), BETA / (1 - (1 - BETA) * (1 - small))
        expected = min(filled, islands)
        assert closest_packing([1.0, 1e-6], [1 - small, small]) == pytest.approx(expected, rel=2e-3)


def test_the_densest_mixture_has_a_quarter_to_a_third_of_small_grains():
    parts = np.linspace(0.0, 1.0, 101)
    packed = np.array([closest_packing([1.0, 0.25], [1 - y, y]) for y in parts])
    assert packed.min() == BETA
    assert 0.25 < parts[packed.argmax()] < 0.4
    # The order of the two classes does not matter.
    assert closest_packing([0.25, 1.0], [0.3, 0.7]) == closest_packing([1.0, 0.25], [0.7, 0.3])


def test_viscosity_follows_einstein_for_few_grains_and_diverges_for_many():
    for fraction in (1e-6, 1e-5):
        assert relative_viscosity(fraction, 0.64) - 1 == pytest.approx(2.5 * fraction, rel=1e-4)
    assert relative_viscosity(0.64, 0.64) == relative_viscosity(0.7, 0.64) == np.inf
    assert relative_viscosity(0.32, 0.64) == pytest.approx(2**1.6)
