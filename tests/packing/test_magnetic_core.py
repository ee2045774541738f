"""Polydisperse colloids: moments and diffusion of each particle follow from its own radius."""

import numpy as np
import pytest
from scipy import stats
from scipy.constants import k as BOLTZMANN

from tests.judged import check_message
from tests.scenes import by_id
from tisim import Cloud, GrainClass, InputError, Open, RandomInBox, Scene, Simulation
from tisim.effects import LangevinMoment, Magnetophoresis
from tisim.operators import InsertionByFlux
from tisim.packing import Clump, EqualSizes, LognormalSizes, MagneticCore
from tisim.sources import MagneticField
from tisim.steppers import Brownian, DriftLimit

SATURATION, SHELL, RATIO, DOMAIN = 4.46e5, 1e-9, 1.3, 8e-9
TEMPERATURE, VISCOSITY = 298.0, 1e-3
SIZES = LognormalSizes(by="number", median=5.6e-9, ratio=1.36, smallest=2e-9, largest=3e-8)
"""The radii of B16 7.4.1, 5.6 nm +- 31 %: exp(ln(ratio)^2) = 1 + 0.31^2."""
CORE = MagneticCore(magnetisation=SATURATION, shell=SHELL, ratio=RATIO, domain=DOMAIN)
BOX = RandomInBox(low=(0, 0, 0), high=(1e-4,) * 3)


def colloid(core=CORE, sizes=SIZES, **more):
    return GrainClass(sizes=sizes, density=5000.0, core=core, **more)


def cloud(number, grains, **more):
    return Cloud(number=number, grains=grains, placement=BOX, **more)


def standard(radius, moment):
    """Z of each particle, ln(m_s / (M_s V)) / ln(ratio)."""
    return np.log(moment / (SATURATION * 4 / 3 * np.pi * (radius - SHELL) ** 3)) / np.log(RATIO)


def scene(particles, *effects, duration=1e-6, steps=1):
    return Scene(
        particles=particles,
        effects=(
            MagneticField(constant=(1.0, 0.0, 0.0)),
            LangevinMoment(temperature=TEMPERATURE),
            Magnetophoresis(),
            *effects,
        ),
        stepper=Brownian(
            temperature=TEMPERATURE,
            viscosity=VISCOSITY,
            control=DriftLimit(longest=duration / steps, drift=1e6),
        ),
        duration=duration,
    )


def test_moments_follow_from_the_radius_of_each_particle():
    start = cloud(40_000, [colloid()]).arrays(Open(), seed=3)
    radius, moment = start["radius"], start["saturation_moment"]
    z = standard(radius, moment)
    assert stats.kstest(z, "norm").pvalue > 0.01
    assert abs(np.corrcoef(z, radius)[0, 1]) < 0.015
    largest = SATURATION * 4 / 3 * np.pi * DOMAIN**3
    np.testing.assert_allclose(start["domain_moment"], np.minimum(moment, largest), rtol=1e-14)
    assert (moment > largest).any()
    # The first particles are the same in a larger cloud.
    few = cloud(100, [colloid()]).arrays(Open(), seed=3)
    np.testing.assert_array_equal(few["saturation_moment"], moment[:100])
    plain = cloud(100, [colloid(MagneticCore(magnetisation=SATURATION))]).arrays(Open(), seed=3)
    volume = 4 / 3 * np.pi * plain["radius"] ** 3
    np.testing.assert_allclose(plain["saturation_moment"], SATURATION * volume, rtol=1e-14)
    assert "domain_moment" not in plain


def test_a_particle_within_its_shell_has_no_moment():
    core = MagneticCore(magnetisation=SATURATION, shell=4e-9)
    start = cloud(2000, [colloid(core)]).arrays(Open(), seed=1)
    small = start["radius"] <= 4e-9
    assert 0.05 < small.mean() < 0.5
    assert (start["saturation_moment"][small] == 0).all()
    assert (start["saturation_moment"][~small] > 0).all()


def test_classes_with_different_cores():
    iron = colloid(MagneticCore(magnetisation=1.7e6, domain=1e-6), EqualSizes(radius=1e-8))
    oxide = colloid(MagneticCore(magnetisation=4e5, domain=1e-6), EqualSizes(radius=2e-8))
    start = cloud(500, [iron, oxide]).arrays(Open(), seed=1)
    material = np.where(start["radius"] == 1e-8, 1.7e6, 4e5)
    np.testing.assert_allclose(
        start["saturation_moment"], material * 4 / 3 * np.pi * start["radius"] ** 3, rtol=1e-14
    )


def test_cores_are_kept_in_files():
    setup = scene(cloud(3, [colloid(), colloid(sizes=EqualSizes(radius=1e-8))]))
    again = Scene.from_dict(setup.to_dict())
    assert again.digest() == setup.digest()
    assert again.particles.grains[0].core == CORE
    other = colloid(CORE.model_copy(update={"shell": 2e-9}))
    assert scene(cloud(3, [other, other])).digest() != setup.digest()


@pytest.mark.parametrize(
    ("grains", "rule"),
    [
        ([colloid(), colloid(None)], "grains.1.quantities must be those of the other classes"),
        (
            [colloid(quantities={"saturation_moment": 1e-19})],
            "grains.0.core must be given once, and none that the grains have; received 'saturation_moment'",
        ),
    ],
)
def test_moments_are_given_once_and_for_all(grains, rule):
    with pytest.raises(InputError) as error:
        cloud(3, grains)
    check_message(str(error.value))
    assert rule in str(error.value)
    with pytest.raises(InputError, match=r"grain_class\.core must be left out if there is a clump"):
        colloid(clump=Clump(centres=[(0, 0, 0)], radii=[1.0], density=1.0))
    with pytest.raises(InputError, match=r"magnetic_core\.ratio must be at least 1"):
        MagneticCore(magnetisation=1.0, ratio=0.5)


@pytest.mark.slow
@pytest.mark.long
def test_inserted_particles_have_moments_by_their_radius():
    """With ratio and domain; and without, as ``domain_moment`` is then the saturation moment of each."""
    for core in (CORE, MagneticCore(magnetisation=SATURATION, shell=SHELL)):
        pour = InsertionByFlux(
            flux=1e12, by="number", number=200, grains=[colloid(core)], low=(0, 0, 0), high=(1e-5,) * 3
        )
        setup = scene(cloud(1, [colloid(core)]), pour, duration=1e-9, steps=5)
        simulation = Simulation(setup)
        simulation.load([setup])
        simulation.run()
        state = by_id(simulation.results()[0])
        simulation.close()
        radius, moment = state["radius"], state["saturation_moment"]
        assert len(radius) == 201
        if core is CORE:
            assert stats.kstest(standard(radius, moment), "norm").pvalue > 0.01
            largest = SATURATION * 4 / 3 * np.pi * DOMAIN**3
            np.testing.assert_allclose(state["domain_moment"], np.minimum(moment, largest), rtol=1e-13)
        else:
            volume = 4 / 3 * np.pi * (radius - SHELL) ** 3
            np.testing.assert_allclose(moment, SATURATION * volume, rtol=1e-13)
            np.testing.assert_array_equal(state["domain_moment"], moment)


@pytest.mark.long
def test_each_particle_diffuses_by_its_own_radius():
    """<r^2> = 6 D t with D = kT/(6 pi eta R), in six classes of size; displacements are normal."""
    setup = scene(cloud(9000, [colloid()]), duration=1e-4, steps=4)
    simulation = Simulation(setup)
    simulation.load([setup])
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    state = by_id(result)
    moved = state["position"] - result.start["position"]
    diffusivity = BOLTZMANN * TEMPERATURE / (6 * np.pi * VISCOSITY * state["radius"])
    normal = moved / np.sqrt(2 * diffusivity * result.time)[:, None]
    assert stats.kstest(normal.ravel(), "norm").pvalue > 0.01
    for chosen in np.array_split(np.argsort(state["radius"]), 6):
        squares = (moved[chosen] ** 2).sum(axis=1) / (6 * diffusivity[chosen] * result.time)
        assert squares.mean() == pytest.approx(1.0, abs=5 * np.sqrt(2 / 3 / len(chosen)))
