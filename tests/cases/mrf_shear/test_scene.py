"""The cell: its sizes, L21's numbers, mixtures, and scenes of equal structure."""

import numpy as np
import pytest

from tisim import InputError
from tisim.cases.case import every
from tisim.cases.common.magnetorheological_fluid import number_of
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.flow_curve import COMPARED, VARIATIONS, magnetised
from tisim.cases.mrf_shear.scene import (
    DENSITY,
    LARGE_RADIUS,
    MAGNETISING_TIME,
    MONODISPERSE,
    RATES,
    SIDES,
    SMALL_RADIUS,
    impact_step,
    mixture,
    scene,
)
from tisim.effects import PrescribedMotion
from tisim.operators import JoinGroup
from tisim.sources import CouetteFlow, MagneticField


def part(made, kind):
    """The only effect of a kind."""
    (one,) = [effect for effect in made.effects if isinstance(effect, kind)]
    return one


def test_parameters_of_table_2_1():
    made = scene()
    iron = made.materials["iron"]
    assert (iron.young, iron.poisson, iron.restitution) == (1e9, 0.278, 0.1)
    assert (iron.friction, iron.rolling_friction, iron.cohesion_energy_density) == (0.1, 0.1, 60e3)
    assert part(made, MagneticField).constant == (0.0, 0.0, 0.6)
    assert published.WALL_SPEEDS[0] / published.CELL_SIDE == pytest.approx(512.0)


def test_rafts_and_oil_move_apart_at_the_shear_rate():
    made = scene(rate=3000.0)
    lower, upper = [effect for effect in made.effects if isinstance(effect, PrescribedMotion)]
    height = SIDES[2] - 16e-6
    assert upper.motion.velocity[0] == -lower.motion.velocity[0] == pytest.approx(3000.0 * height / 2)
    oil = part(made, CouetteFlow)
    assert (oil.first, oil.second, oil.begin) == (8e-6, pytest.approx(52e-6), MAGNETISING_TIME)
    assert oil.second_velocity == upper.motion.velocity
    assert part(scene(still=True), CouetteFlow).second_velocity == (0.0, 0.0, 0.0)
    assert made.duration == pytest.approx(MAGNETISING_TIME + 1.0 / 3000.0)
    joins = [effect for effect in made.effects if isinstance(effect, JoinGroup)]
    assert [one.time for one in joins] == [MAGNETISING_TIME] * 2
    assert magnetised({"rate": 3000.0}, 4).duration == MAGNETISING_TIME


def test_compared_scenes_have_one_structure():
    """All of them run as one batch, except for grains that saturate, which have another law."""
    structure = scene().structure()
    for name, settings in VARIATIONS.items():
        alike = scene(**{**COMPARED, **settings}).structure() == structure
        assert alike == ("saturation" not in settings), name
    for rate in RATES:
        assert scene(rate=rate, flux=0.1, young=1e8, fraction=0.2).structure() == structure


@pytest.mark.parametrize("share", [0.0, 0.2, 1 / 3, 1.0])
def test_a_mixture_fills_its_fraction_with_its_share(share):
    volume, fraction = 1e-12, 0.3
    grains = mixture(share)
    number = number_of(grains, fraction, volume)
    large, small = (4 / 3 * np.pi * r**3 for r in (LARGE_RADIUS, SMALL_RADIUS))
    expected = fraction * volume * ((1 - share) / large + share / small)
    assert number == pytest.approx(expected, abs=1)
    assert number_of(MONODISPERSE, 0.3, np.prod(SIDES)) == 183
    assert sum(one.share for one in grains) == pytest.approx(1.0)
    assert {one.density for one in grains} == {DENSITY}


def test_a_step_is_a_part_of_an_impact_and_scales_with_the_size():
    """Hertz: at equal speed it is proportional to the radius and to the modulus to the power -2/5."""
    assert impact_step(2e-6, 1e9) == pytest.approx(2 * impact_step(1e-6, 1e9), rel=0.01)
    assert impact_step(1e-6, 1e7) == pytest.approx(100**0.4 * impact_step(1e-6, 1e9), rel=0.01)
    assert 3e-9 < impact_step(LARGE_RADIUS, 1e9) < 6e-9


NUMBERS = {
    "l21": 12_000, "l21_volume": 60_000, "l21_bidisperse": 200_000, "l21_monodisperse": 30_000
}  # fmt: skip
"""Approximate numbers of grains in L21's cells (section 2.4.3)."""


@pytest.mark.parametrize("size", NUMBERS)
def test_cells_of_l21_have_its_numbers_of_grains(size):
    made = every()["mrf_shear"].scene(size, 1)
    assert made.seed == 1
    assert made.particles.number == pytest.approx(NUMBERS[size], rel=0.03)
    assert made.domain.high == (250e-6,) * 3
    assert made.stepper.control.dt == 2e-10
    assert made.duration == pytest.approx(0.93 / published.SHEAR_RATES[0] + 1e5 * 2e-10)
    # The cell is open along the field.
    assert "walls" not in {effect.kind() for effect in made.effects}
    assert made.materials.keys() == {"iron"}


def test_a_cell_of_many_sizes_is_wider_than_the_range_of_its_grains():
    """It is wider than twice the range of the two largest grains, and its step suits the smallest."""
    made = every()["mrf_shear"].scene("polydisperse", 0)
    radius = made.particles.arrays(made.domain, 0)["radius"]
    assert made.domain.high[0] > 2 * (24.44e-6 + published.NEIGHBOUR_GAP)
    assert 1.46e-6 / 2 <= radius.min() < radius.max() <= 24.44e-6 / 2
    assert made.stepper.control.dt == pytest.approx(impact_step(0.73e-6, 1e9))


def test_a_step_of_zero_is_refused():
    with pytest.raises(InputError, match=r"dt must be at least .*; received 0\.0"):
        scene(dt=0.0)
