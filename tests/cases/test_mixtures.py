"""L21's mixtures are drawn as they are printed."""

import numpy as np
import pytest

from tisim.cases import mixtures
from tisim.packing.grains import draw, masses


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
    """100 000 grains: each size as often, or of as much mass, as the table says."""
    made = mixtures.classes(mixtures.LARGE_GRAINS, by)
    which, radius = draw(made, 100_000, seed=3)
    weight = np.ones(len(radius)) if by == "number" else masses(made, which, radius)
    found = np.bincount(which, weight, minlength=len(made)) / weight.sum()
    diameter, part = numbers(mixtures.LARGE_GRAINS)
    np.testing.assert_allclose(2 * np.array([one.sizes.radius for one in made]), diameter)
    # Of the mass, a single large grain may be much.
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
