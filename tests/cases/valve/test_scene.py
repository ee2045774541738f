"""The valve: L21's numbers in it, its shape, the oil, and what is one structure."""

import itertools

import numpy as np
import pytest
from scipy.integrate import dblquad

from cases.case import every
from cases.mrf_shear.grains import equal
from cases.valve import published
from cases.valve.duct import Duct
from cases.valve.measures import drag_pressure, duct_of, oil_of
from cases.valve.scene import mean_radius, scene, speed_of
from cases.valve.sizes import COARSE, FINE_GRAINS, THROATS
from tests.cases.valve.states import at_rest
from tisim.effects import MutualInducedMoment, StokesDrag, TruncatedDipoleDipole
from tisim.sources import MagneticField, sample

DUCT = Duct(throat=2.0, bore=5.0, straight=1.5, taper=1.0, length=8.0)


def part(made, kind):
    """The only effect of a kind."""
    (one,) = [effect for effect in made.effects if isinstance(effect, kind)]
    return one


@pytest.mark.parametrize(("size", "throat"), [("l21_20", 0.88e-3), ("l21_30", 1.32e-3), ("l21_40", 1.76e-3)])
def test_numbers_of_l21(size, throat):
    made = every()["valve"].scene(size, 1)
    iron = made.materials["iron"]
    assert made.seed == 1
    assert (iron.young, iron.friction) == (1e9, 0.4)
    assert part(made, StokesDrag).viscosity == 0.16
    field = part(made, MagneticField)
    assert (field.constant, field.begin) == ((0.23, 0.0, 0.0), 1e-3)
    assert made.stepper.control.dt == 20e-9
    assert duct_of(made).throat == pytest.approx(throat)
    assert oil_of(made).speed == 0.273
    sizes = {round(2e6 * float(one.sizes.nodes()[0].mean()), 2): one.share for one in made.particles.grains}
    parts = {44: 44, 38.9: 35, 33.8: 24.2, 28.7: 13.2, 23.6: 5.6}
    assert sizes == pytest.approx({one: part / 122 for one, part in parts.items()})
    # Grains at rest are dragged with about 100 kPa, and fill 0.345.
    duct = duct_of(made)
    speed = speed_of(published.PRESSURE, duct, made.particles.grains, published.FRACTION)
    assert 100e3 * 0.273 / speed == pytest.approx(100e3, rel=0.5)
    volume = sum(one.share / one.density for one in made.particles.grains) / sum(
        one.number() for one in made.particles.grains
    )
    assert made.particles.number * volume == pytest.approx(0.345 * duct.filling().volume(), rel=1e-4)
    assert made.particles.number > 40_000


def test_the_fine_mixture_of_l21():
    made = every()["valve"].scene("l21_fine", 0)
    assert made.stepper.control.dt == 5e-9
    assert duct_of(made).throat == pytest.approx(1.32e-3)
    largest = max(float(one.sizes.nodes()[0].max()) for one in made.particles.grains)
    assert 2 * largest == pytest.approx(10e-6)
    assert duct_of(made).length < duct_of(every()["valve"].scene("l21_30", 0)).length


def test_what_l21_finds():
    assert [throat / published.LARGEST for throat in published.CONSTRICTIONS.values()] == pytest.approx(
        [20, 30, 40]
    )
    assert published.JAMS == {20: True, 30: True, 40: False}


def test_the_duct_of_a_scene_is_the_one_that_was_asked_for():
    made = scene(throat=200e-6, bore=400e-6, straight=60e-6, slope=0.5, length=700e-6)
    duct = duct_of(made)
    assert vars(duct) == pytest.approx(vars(Duct(200e-6, 400e-6, 60e-6, 50e-6, 700e-6)))
    assert made.domain.high == pytest.approx((200e-6, 200e-6, 350e-6))
    assert made.particles.placement.volume() == pytest.approx(duct.filling().volume())


def test_oil_is_that_of_the_source_and_its_integral_that_over_the_duct(rng):
    points = rng.uniform((-2.6, -2.6, -4.0), (2.6, 2.6, 4.0), (300, 3))
    velocity, _ = sample((DUCT.oil(3.0),), "flow_velocity", points)
    rho = np.hypot(points[:, 0], points[:, 1])
    np.testing.assert_allclose(velocity[:, 2], 3.0 * DUCT.oil_speed(rho, points[:, 2]), rtol=1e-5, atol=1e-5)
    heights, radii = DUCT.profile()
    total = 0.0
    for low, high in itertools.pairwise(heights):
        # Split where the oil's profile has its edge, at the radius of the constriction.
        for a, b in ((0.0, 1.0), (1.0, None)):
            total += dblquad(
                lambda r, z: 2 * np.pi * r * float(DUCT.oil_speed(np.array(r), np.array(z - 4.0))),
                low + 1e-9, high - 1e-9, a,
                lambda z, b=b: b or max(float(np.interp(z, heights, radii)), 1.0),
                epsabs=1e-6,
            )[0]  # fmt: skip
    assert DUCT.oil_through() == pytest.approx(total, rel=1e-4)


@pytest.mark.parametrize("grains", [COARSE, FINE_GRAINS])
def test_the_drag_on_grains_at_rest_is_the_pressure_asked_for(grains):
    made = scene(grains=grains, pressure=80e3)
    result = at_rest(made)
    assert drag_pressure(result) == pytest.approx(80e3, rel=0.08)


def test_the_speed_goes_as_the_pressure_and_as_the_square_of_the_grains():
    duct = duct_of(scene())
    one = speed_of(1e5, duct, COARSE, 0.345)
    assert speed_of(2e5, duct, COARSE, 0.345) == pytest.approx(2 * one)
    assert speed_of(1e5, duct, FINE_GRAINS, 0.345) == pytest.approx(one / 4, rel=2e-3)
    assert mean_radius(equal(3e-6, 1.0)) == pytest.approx(3e-6)


def test_what_is_compared_is_one_structure():
    """So that all of it runs as one batch."""
    structure = scene().structure()
    for throat in THROATS:
        assert (
            scene(throat=throat, flux=0.0, grains=FINE_GRAINS, young=1e8, pressure=5e4).structure()
            == structure
        )


def test_magnetic_laws_have_one_cut_off():
    made = scene()
    moment, force = part(made, MutualInducedMoment), part(made, TruncatedDipoleDipole)
    assert (moment.cutoff, moment.gap) == (force.cutoff, force.gap)
    assert moment.sweeps == 0
