"""The valve: L21's numbers, its shape, the oil, and scenes of equal structure."""

import itertools

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.spatial import cKDTree

from tests.cases.valve.states import at_rest
from tisim import GrainClass, InputError
from tisim.cases.case import every
from tisim.cases.common.magnetorheological_fluid import equal
from tisim.cases.valve import published
from tisim.cases.valve.duct import Duct
from tisim.cases.valve.measures import drag_pressure, duct_of, oil_of, pressure_at_rest
from tisim.cases.valve.scene import COARSE, FINE_GRAINS, SIZES, THROATS, mean_radius, scene, speed_of
from tisim.effects import MutualInducedMoment, StokesDrag, TruncatedDipoleDipole
from tisim.packing import EqualSizes, UniformSizes
from tisim.sources import MagneticField, sample

UM = 1e-6
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
    # The volume fraction is 0.345.
    duct = duct_of(made)
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


def test_constrictions_are_named_by_their_width_in_grains():
    for width, throat in published.CONSTRICTIONS.items():
        assert throat / published.LARGEST == pytest.approx(width)


@pytest.mark.parametrize(
    ("size", "pressure"), [("l21_20", 90e3), ("l21_30", 117e3), ("l21_40", 141e3), ("l21_fine", 724e3)]
)
def test_the_drag_on_grains_at_rest_and_their_number_at_the_sizes_of_l21(size, pressure):
    """At none of the sizes is it L21's 100 kPa."""
    made = every()["valve"].scene(size, 0)
    assert pressure_at_rest(made) == pytest.approx(pressure, rel=0.02)
    assert f"{made.particles.number:,} grains" in SIZES[size].summary


def test_the_duct_of_a_scene_has_the_given_dimensions():
    made = scene(throat=200e-6, bore=400e-6, straight=60e-6, slope=0.5, length=700e-6)
    duct = duct_of(made)
    assert vars(duct) == pytest.approx(vars(Duct(200e-6, 400e-6, 60e-6, 50e-6, 700e-6)))
    assert made.domain.high == pytest.approx((200e-6, 200e-6, 350e-6))
    assert made.particles.placement.volume() == pytest.approx(duct.filling().volume())


def test_oil_agrees_with_its_source_and_with_its_integral_over_the_duct(rng):
    points = rng.uniform((-2.6, -2.6, -4.0), (2.6, 2.6, 4.0), (300, 3))
    velocity, _ = sample((DUCT.oil(3.0),), "flow_velocity", points)
    rho = np.hypot(points[:, 0], points[:, 1])
    np.testing.assert_allclose(velocity[:, 2], 3.0 * DUCT.oil_speed(rho, points[:, 2]), rtol=1e-5, atol=1e-5)
    heights, radii = DUCT.profile()
    total = 0.0
    for low, high in itertools.pairwise(heights):
        # The integral is split at the kink of the oil's profile, at the radius of the constriction.
        for a, b in ((0.0, 1.0), (1.0, None)):
            total += dblquad(
                lambda r, z: 2 * np.pi * r * float(DUCT.oil_speed(np.array(r), np.array(z - 4.0))),
                low + 1e-9, high - 1e-9, a,
                lambda z, b=b: b or max(float(np.interp(z, heights, radii)), 1.0),
                epsabs=1e-6,
            )[0]  # fmt: skip
    assert DUCT.oil_through() == pytest.approx(total, rel=1e-4)


def test_distances_from_the_wall(rng):
    """They are compared with the nearest of many points on the wall, also around its convex edges."""
    heights, radii = DUCT.profile()
    along = np.linspace(0, 8, 80_001)
    wall = np.column_stack([np.interp(along, heights, radii), along - 4.0])
    z = rng.uniform(-3.0, 3.0, 300)
    rho = rng.uniform(0, 1, 300) * np.interp(z + 4.0, heights, radii)
    expected, _ = cKDTree(wall).query(np.column_stack([rho, z]))
    np.testing.assert_allclose(DUCT.depth(rho, z), expected, atol=1e-4)


@pytest.mark.parametrize("grains", [COARSE, FINE_GRAINS])
def test_the_drag_on_grains_at_rest_is_the_given_pressure(grains):
    made = scene(grains=grains, pressure=80e3)
    result = at_rest(made)
    assert drag_pressure(result) == pytest.approx(80e3, rel=0.08)
    assert pressure_at_rest(made) == pytest.approx(80e3, rel=2e-3)


def test_the_speed_is_proportional_to_the_pressure_and_the_squared_radius():
    duct = duct_of(scene())
    one = speed_of(1e5, duct, COARSE, 0.345)
    assert speed_of(2e5, duct, COARSE, 0.345) == pytest.approx(2 * one)
    assert speed_of(1e5, duct, FINE_GRAINS, 0.345) == pytest.approx(one / 4, rel=2e-3)
    assert mean_radius(equal(3e-6, 1.0)) == pytest.approx(3e-6)


def test_compared_scenes_have_one_structure():
    """All of them run as one batch."""
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


def test_the_mean_radius_is_by_the_number_of_grains():
    """A class that is uniform by volume from r to 2 r has the mean (1 - 1/2) / ((1 - 1/4) / 2) r = 4/3 r and
    (1 - 1/4) / 2 / (r^3 rho) grains by mass and r. The second class has equal grains of 3 r."""
    wide = GrainClass(sizes=UniformSizes(by="volume", smallest=UM, largest=2 * UM), density=1e3)
    assert mean_radius([wide]) == pytest.approx(4 / 3 * UM)
    equal_ones = GrainClass(sizes=EqualSizes(radius=3 * UM), density=1e3)
    numbers = 3 / 8, 1 / 27
    expected = (numbers[0] * 4 / 3 + numbers[1] * 3) / sum(numbers)
    assert mean_radius([wide, equal_ones]) == pytest.approx(expected * UM)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"pressure": 1e4, "speed": 3.0}, "pressure must be left out if the speed is given; received 1"),
        ({"dt": 0.0}, r"dt must be at least .*; received 0\.0"),
        ({"throat": 352 * UM}, r"constriction must be above 0 and below 0\.000352 m, the bore; received"),
        ({"straight": 0.0}, "length of the constriction must be above 0; received"),
        ({"slope": 0.0}, "length of a cone must be above 0; received"),
        (
            {"length": 200 * UM},
            r"length of the duct must be above 0\.00022 m, the length of the constriction",
        ),
    ],
)
def test_invalid_valves_are_refused(settings, message):
    with pytest.raises(InputError, match=message):
        scene(**settings)


def test_a_given_speed_is_used():
    assert oil_of(scene(speed=3.0)).speed == 3.0
