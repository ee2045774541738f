"""The clouds: L21's numbers, scaled copies with fewer grains, and closed forms."""

import numpy as np
import pytest
from scipy.constants import Boltzmann, G, mu_0

from tisim.analysis import contacts
from tisim.cases.coalescence import published
from tisim.cases.coalescence.regime import (
    IRON_DENSITY,
    balanced_gravity,
    dmt_cohesion,
    dominated,
    mutual_gravity,
    spin_when_packed,
    surface_cohesion,
    surface_weight,
)
from tisim.cases.coalescence.scene import (
    DEFAULT,
    ROTATION,
    SIZES,
    lattice_ball,
    scale_of,
    scene,
    scene_for,
    step,
    thermal_speed,
)
from tisim.cases.common.rubble_pile import critical_spin, free_fall, mean_density
from tisim.cases.common.two_spheres import attraction, sphere_mass
from tisim.effects import PermanentMoment, SelfGravity, TreeGravity, TruncatedDipoleDipole


def effect(made, kind):
    return next(one for one in made.effects if isinstance(one, kind))


@pytest.mark.parametrize(("size", "diameter"), [("l21", 1.0), ("l21_50cm", 0.5)])
def test_the_sizes_of_l21_have_its_numbers(size, diameter):
    made = scene_for(size, 0)
    start = made.start()
    assert len(start["mass"]) == 32_662 + 1
    assert 2 * start["radius"][0] == 5.0
    assert set(2 * start["radius"][1:]) == {diameter}
    np.testing.assert_allclose(start["mass"], 3000 * np.pi / 6 * (2 * start["radius"]) ** 3)
    assert len(contacts(start["position"], start["radius"])) == 0
    # The grains are on a lattice of 2 m within a ball.
    np.testing.assert_array_equal(start["position"] % 2.0, 0.0)
    assert np.linalg.norm(start["position"], axis=1).max() == pytest.approx(39.7, abs=0.5)
    rock = made.materials["rubble"]
    assert (rock.young, rock.poisson, rock.restitution, rock.surface_energy) == (1e6, 0.3, 0.1, 2.86e-3)
    assert (rock.friction, rock.rolling_friction) == (0.4, 0.8)
    assert (rock.rolling_stiffness, rock.rolling_damping) == (10.0, 0.4)
    moment = np.linalg.norm(start["moment"], axis=1)
    np.testing.assert_allclose(moment, 1190 * np.pi / 6 * (2 * start["radius"]) ** 3)
    assert effect(made, TruncatedDipoleDipole).cutoff == 6.0
    assert effect(made, TreeGravity)
    assert made.duration == 15_000.0


def test_velocities_are_thermal_around_a_rotation_without_momentum():
    made = scene(number=2000, rotation=1e-3, seed_diameter=0.0, of=2000)
    start = made.start()
    assert np.abs(start["mass"] @ start["velocity"]).max() < 1e-9 * start["mass"].sum()
    random = start["velocity"] - np.cross([0.0, 0.0, 1e-3], start["position"])
    mass = sphere_mass(1.0, 3000.0)
    expected = np.sqrt(Boltzmann * 8e20 / mass)
    assert random.std() == pytest.approx(expected, rel=0.03)
    assert thermal_speed(0.5, np.array([mass / 8])) == pytest.approx(expected)
    assert start["spin"].mean() == pytest.approx(5e-5, abs=5e-6)
    assert start["spin"].std() == pytest.approx(1e-4, rel=0.03)


def test_a_smaller_cloud_is_a_copy():
    """Velocities scale with the size and stresses with its square; steps are longer."""
    whole, small = (scene(number=n, rotation=0.0, seed_diameter=0.0, of=1000, seed=3) for n in (1000, 125))
    assert scale_of(125, 1000) == pytest.approx(0.5)
    a, b = whole.start(), small.start()
    assert b["velocity"].std() / a["velocity"].std() == pytest.approx(0.5, rel=0.1)
    assert b["spin"].std() / a["spin"].std() == pytest.approx(0.5, rel=0.1)
    big, little = whole.materials["rubble"], small.materials["rubble"]
    assert little.young / big.young == pytest.approx(0.25)
    assert little.surface_energy / big.surface_energy == pytest.approx(0.25)
    sizes = [effect(one, PermanentMoment).magnetisation for one in (whole, small)]
    assert sizes[1] / sizes[0] == pytest.approx(0.5)
    assert step(1.0, 0.5) / step(1.0, 1.0) == pytest.approx(2.0, rel=5e-3)
    # Softer contacts last longer, as E^(-2/5).
    assert step(1.0, 1.0, softened=10.0) / step(1.0, 1.0) == pytest.approx(10**0.4, rel=5e-3)


def test_the_default_is_all_pairs_and_the_seed_the_heaviest():
    made = scene_for("default", 5)
    assert effect(made, SelfGravity)
    start = made.start()
    assert len(start["mass"]) == DEFAULT["number"] + 1
    assert start["mass"].argmax() == 0
    np.testing.assert_array_equal(scene_for("unmagnetised", 5).start()["position"], start["position"])
    assert not np.array_equal(scene_for("default", 6).start()["velocity"], start["velocity"])
    assert "moment" not in scene_for("unmagnetised", 0).start()
    assert SIZES.keys() == {"default", "unmagnetised", "small", "l21", "l21_50cm"}


def test_sites_are_the_nearest_to_the_middle():
    sites = lattice_ball(27, 2.0)
    squares = (sites**2).sum(axis=1)
    assert (np.diff(squares) >= 0).all()
    assert len(np.unique(sites, axis=0)) == 27
    # 1 + 6 + 12 + 8 sites are within sqrt(3) spacings.
    assert squares.max() == 3 * 4.0
    around = np.linalg.norm(lattice_ball(20, 2.0, 2.5), axis=1)
    assert (around.min(), around.max()) == pytest.approx((8.0**0.5, 12.0**0.5))


def test_closed_forms_of_clouds():
    """The free-fall time of a cloud is half the period of an orbit with half its radius. The critical spin is
    the rate of an orbit at the equator."""
    density = mean_density(0.5, 2.0, 3000.0)
    assert free_fall(density) == pytest.approx(13_400, abs=50)
    radius = 7.0
    mass = 4 / 3 * np.pi * radius**3 * density
    assert free_fall(density) == pytest.approx(np.pi * np.sqrt((radius / 2) ** 3 / (G * mass)))
    assert critical_spin(density) == pytest.approx(np.sqrt(G * mass / radius**3))
    assert critical_spin(1800.0) == pytest.approx(7.1e-4, rel=0.01)
    # The rotations printed in L21 disrupt its clouds; the default rotation leaves a stable pile.
    for d in published.DIAMETERS:
        assert min(published.ROTATIONS) > 2 * critical_spin(mean_density(d, 2.0, 3000.0))
        assert spin_when_packed(min(published.ROTATIONS), d, 2.0) > 2 * critical_spin(1800.0)
    assert 0.25 < spin_when_packed(ROTATION, 1.0, 2.0) / critical_spin(1800.0) < 0.35


def test_closed_forms_of_grains():
    m, d = 1190 * np.pi / 6, 1.0
    energy = lambda r: -mu_0 / (4 * np.pi) * 2 * m * m / r**3  # noqa: E731
    h = 1e-5
    slope = (energy(d + h) - energy(d - h)) / (2 * h)
    assert attraction(d, 1190.0) == pytest.approx(slope, rel=1e-6)
    mass = sphere_mass(0.7, 3000.0)
    assert mutual_gravity(0.7, 3000.0) == pytest.approx(G * mass**2 / 0.7**2)
    assert surface_weight(0.7, 3000.0, 2.0) == pytest.approx(2 * mass)
    assert dmt_cohesion(0.5, 2.86e-3) == pytest.approx(4 * np.pi * 2.86e-3 * 0.125)


def test_which_force_dominates():
    """L21 section 4.6: gravity exceeds the magnetic force at 119 A/m, by less for smaller grains.

    L21 also calls them nearly equal at 1190 A/m, which contradicts its Eqs (4.1) and (4.13)."""
    weak, strong = (
        [attraction(d, m) / surface_weight(d, 3000.0, 5e-6) for d in (0.5, 1.0)] for m in (119.0, 1190.0)
    )
    assert weak == pytest.approx([0.59, 0.30], abs=0.01)
    assert strong == pytest.approx([59, 30], abs=1)


def test_lines_of_equal_force():
    """L21 Fig. 4.16; and section 4.5, for 1190 A/m, S = 0.1 and 1e-4 m/s^2: from some 1e-4 m to 1e-1 m."""
    for d in (5e-3, 0.5):
        gravity = balanced_gravity(d, 119.0, IRON_DENSITY)
        assert surface_weight(d, IRON_DENSITY, gravity) == pytest.approx(attraction(d, 119.0))
    smallest, largest = dominated(1190.0, 1e-4, 0.1, IRON_DENSITY)
    assert attraction(smallest, 1190.0) == pytest.approx(surface_cohesion(smallest, 0.1))
    assert attraction(largest, 1190.0) == pytest.approx(surface_weight(largest, IRON_DENSITY, 1e-4))
    assert smallest == pytest.approx(0.77e-3, abs=1e-5)
    assert largest == pytest.approx(0.57, abs=0.01)
