"""Size distributions compared with SciPy, by number and by volume, and mixtures of grain classes."""

import numpy as np
import pytest
from scipy import integrate, stats

from tests.judged import check_message
from tisim import Box, Cloud, GrainClass, InputError, Material, Open, RandomInBox, RandomInCylinder, Scene
from tisim.packing import EqualSizes, LognormalSizes, NormalSizes, SieveCurve, UniformSizes, WeibullSizes
from tisim.packing.grains import draw, masses

BOUNDS = {"smallest": 4e-4, "largest": 3e-3}
LAWS = {
    "uniform": (UniformSizes, {}, stats.uniform(4e-4, 2.6e-3)),
    "normal": (NormalSizes, {"mean": 1e-3, "deviation": 3e-4}, stats.norm(1e-3, 3e-4)),
    "lognormal": (LognormalSizes, {"median": 1e-3, "ratio": 1.4}, stats.lognorm(np.log(1.4), scale=1e-3)),
    "weibull": (WeibullSizes, {"scale": 1.2e-3, "shape": 3.5}, stats.weibull_min(3.5, scale=1.2e-3)),
}


def truth(law, power):
    """The cumulative distribution by number and a function for the mean of r^k.

    power : power of r by which the density q is weighted.
    """
    low, high = BOUNDS.values()
    points = np.linspace(low, high, 20001)
    density = law.pdf(points) / points**power
    cumulative = integrate.cumulative_simpson(density, x=points, initial=0)

    def mean(k):
        return integrate.simpson(density * points**k, x=points) / cumulative[-1]

    return lambda r: np.interp(r, points, cumulative / cumulative[-1]), mean


@pytest.mark.parametrize("by", ["number", "volume"])
@pytest.mark.parametrize("name", LAWS)
def test_sizes_follow_the_distributions_of_scipy(name, by):
    """Kolmogorov-Smirnov test of 4e5 sizes at the level of 1 %.

    A distribution by volume taken for one by number would deviate 20 times more.
    """
    kind, values, law = LAWS[name]
    sizes = kind(by=by, **BOUNDS, **values)
    cumulative, mean = truth(law, 0 if by == "number" else 3)
    _, radius = draw([GrainClass(sizes=sizes, density=1.0)], 400_000, seed=7)
    assert radius.min() >= BOUNDS["smallest"]
    assert radius.max() <= BOUNDS["largest"]
    distance = stats.kstest(radius, cumulative).statistic
    assert distance < stats.kstwo.ppf(0.99, len(radius))
    other, _ = truth(law, 3 if by == "number" else 0)
    assert stats.kstest(radius, other).statistic > 20 * distance
    assert sizes.mean_cube() == pytest.approx(mean(3), rel=1e-5)
    assert sizes.mean_radius() == pytest.approx(mean(1), rel=1e-5)
    uniform = np.array([0.01, 0.1, 0.5, 0.9, 0.99])
    np.testing.assert_allclose(cumulative(sizes.radii(uniform)), uniform, atol=1e-5)


@pytest.mark.parametrize("name", LAWS)
def test_by_mass_is_by_volume_within_a_class(name):
    kind, values, _ = LAWS[name]
    by_mass, by_volume = (kind(by=by, **BOUNDS, **values) for by in ("mass", "volume"))
    np.testing.assert_array_equal(by_mass.table(), by_volume.table())
    uniform = np.linspace(0, 1, 999)
    np.testing.assert_array_equal(by_mass.radii(uniform), by_volume.radii(uniform))
    assert by_mass.mean_cube() == by_volume.mean_cube()


def test_sieve_curves_of_a_mixture_of_densities():
    """Two classes by mass; the denser one has a quarter of the mass.

    Checked are the sieve curves of each class and of the mixture.
    """
    diameters, passing = (1e-3, 2e-3, 4e-3), (0.0, 0.3, 1.0)
    coarse = SieveCurve(by="mass", diameters=diameters, passing=passing)
    fine = SieveCurve(by="mass", diameters=tuple(0.5 * d for d in diameters), passing=passing)
    classes = (GrainClass(sizes=coarse, density=2000.0, share=3.0), GrainClass(sizes=fine, density=8000.0))
    which, radius = draw(classes, 400_000, seed=5)
    mass = masses(classes, which, radius)
    for k, one in enumerate((coarse, fine)):
        own, size = mass[which == k], 2 * radius[which == k]
        found = [own[size <= d].sum() / own.sum() for d in one.diameters]
        np.testing.assert_allclose(found, passing, atol=0.01)
    # Grains of the coarse class that pass 2 mm, and all of the fine class.
    assert mass[2 * radius <= 2e-3].sum() / mass.sum() == pytest.approx(0.75 * 0.3 + 0.25, abs=0.01)


def test_a_lognormal_law_over_volume_is_one_over_number():
    """The Hatch-Choate conversion, with bounds far out."""
    far = {"smallest": 1e-4, "largest": 2e-2}
    by_volume = LognormalSizes(by="volume", median=1e-3, ratio=1.3, **far)
    median = 1e-3 * np.exp(-3 * np.log(1.3) ** 2)
    by_number = LognormalSizes(by="number", median=median, ratio=1.3, **far)
    uniform = np.linspace(0.001, 0.999, 99)
    np.testing.assert_allclose(by_volume.radii(uniform), by_number.radii(uniform), rtol=1e-4)


def test_a_sieve_curve_is_reproduced_by_sieves():
    """Compared is the mass of the grains that pass each sieve."""
    diameters, passing = np.array([1e-3, 2e-3, 4e-3, 5e-3]), np.array([0.0, 0.3, 0.3, 1.0])
    curve = SieveCurve(by="volume", diameters=tuple(diameters), passing=tuple(passing))
    _, radius = draw([GrainClass(sizes=curve, density=2.0)], 400_000, seed=3)
    mass = radius**3
    found = np.array([mass[2 * radius <= d].sum() for d in diameters]) / mass.sum()
    np.testing.assert_allclose(found, passing, atol=0.005)
    between = mass[2 * radius <= 1.5e-3].sum() / mass.sum()
    assert between == pytest.approx(0.15, abs=0.005)
    # By number the same curve counts grains.
    counted = curve.model_copy(update={"by": "number"}).radii((np.arange(10_000) + 0.5) / 10_000)
    assert np.mean(2 * counted <= 2e-3) == pytest.approx(0.3, abs=1e-4)


MIXTURE = (
    GrainClass(sizes=EqualSizes(radius=2e-3), density=2500.0, share=3.0, quantities={"temperature": 350.0}),
    GrainClass(
        sizes=UniformSizes(by="volume", smallest=4e-4, largest=8e-4),
        density=7800.0,
        quantities={"temperature": 300.0},
    ),
)


def test_classes_of_a_mixture_have_their_share_of_the_mass():
    which, radius = draw(MIXTURE, 200_000, seed=1)
    mass = masses(MIXTURE, which, radius)
    assert mass[which == 0].sum() / mass.sum() == pytest.approx(0.75, abs=0.005)
    assert (radius[which == 0] == 2e-3).all()
    np.testing.assert_allclose(mass[which == 1], 7800 * 4 / 3 * np.pi * radius[which == 1] ** 3)
    again, same = draw(MIXTURE, 1000, seed=1)
    np.testing.assert_array_equal(radius[:1000], same)
    np.testing.assert_array_equal(which[:1000], again)
    assert (draw(MIXTURE, 1000, seed=2)[1] != same).any()


def gaps(position, radius, side=np.inf):
    apart = position[:, None] - position
    if np.isfinite(side):
        apart -= side * np.rint(apart / side)
    distance = np.linalg.norm(apart, axis=2) - radius[:, None] - radius
    return distance[np.triu_indices(len(radius), 1)]


def test_unequal_spheres_lie_inside_without_overlap():
    """Sizes span a factor of 5 and fill a fifth of the volume; checked also across periodic faces."""
    box = RandomInBox(low=(0, 0, 0), high=(0.02, 0.02, 0.05))
    start = Cloud(number=900, grains=MIXTURE, placement=box).arrays(Open(), seed=4)
    r, radius = start["position"], start["radius"]
    assert np.ptp(radius) > 1e-3
    assert gaps(r, radius).min() >= 0
    assert (r >= radius[:, None]).all()
    assert (r <= np.array([0.02, 0.02, 0.05]) - radius[:, None]).all()
    # Small grains use space that large grains cannot.
    assert r[:, 0].min() < 1e-3
    np.testing.assert_array_equal(start["temperature"], np.where(radius == 2e-3, 350.0, 300.0))
    np.testing.assert_array_equal(start["mass"], Cloud(number=900, grains=MIXTURE, placement=box).masses(4))
    domain = Box(low=(0, 0, 0), high=(0.02, 0.02, 0.02))
    start = Cloud(number=300, grains=MIXTURE).arrays(domain, seed=4)
    assert gaps(start["position"], start["radius"], 0.02).min() >= 0
    assert gaps(start["position"], start["radius"]).min() >= 0


def test_spheres_lie_wholly_inside_a_cylinder():
    cylinder = RandomInCylinder(centre=(1.0, 0, 0), axis=(0, 1, 1), radius=0.01, length=0.04)
    start = Cloud(number=400, grains=MIXTURE, placement=cylinder).arrays(Open(), seed=2)
    r, radius, axis = start["position"] - [1.0, 0, 0], start["radius"], np.array([0, 1, 1]) / np.sqrt(2)
    along = r @ axis
    away = np.linalg.norm(r - along[:, None] * axis, axis=1)
    assert (np.abs(along) <= 0.02 - radius + 1e-15).all()
    assert (away <= 0.01 - radius + 1e-15).all()
    assert gaps(r, radius).min() >= -1e-15
    # They fill the cylinder: the outer half of the section contains about half of the small grains.
    small = radius < 1e-3
    assert 0.3 < np.mean(away[small] > 0.01 / np.sqrt(2)) < 0.6
    # Equal spheres can be placed up to saturation, also in a round region.
    dense = RandomInCylinder(radius=0.01, length=0.04)
    start = Cloud(number=870, radius=1e-3, density=1.0, placement=dense).arrays(Open(), seed=2)
    assert gaps(start["position"], start["radius"]).min() >= -1e-15
    assert np.hypot(*start["position"][:, :2].T).max() <= 9e-3


def test_classes_name_their_materials():
    """A class without a material gets the material of the cloud, or the first of the scene."""
    named = (MIXTURE[0], MIXTURE[1].model_copy(update={"material": "ore"}))
    materials = {name: Material() for name in ("glass", "ore", "sand")}
    for material, index in ((None, 0), ("sand", 2)):
        cloud = Cloud(number=200, grains=named, material=material)
        scene = Scene(
            particles=cloud, materials=materials, domain=Box(low=(0, 0, 0), high=(1, 1, 1)), duration=1.0
        )
        for seed in (0, 5):
            start = scene.start(seed)
            expected = np.where(start["radius"] == 2e-3, index, 1)
            np.testing.assert_array_equal(start["material"], expected)
            assert 0 < np.mean(expected == 1) < 1
        assert Scene.from_dict(scene.to_dict()) == scene
    with pytest.raises(InputError, match=r"grains.1.material must be one of the materials .*glass.*'ore'"):
        scene.replace({"materials": {"glass": {}, "sand": {}}})


def test_a_mixture_is_read_back_from_a_file():
    scene = Scene(
        particles=Cloud(number=9, grains=MIXTURE), domain=Box(low=(0, 0, 0), high=(1, 1, 1)), duration=1.0
    )
    again = Scene.from_dict(scene.to_dict())
    assert again == scene
    assert again.digest() == scene.digest()
    denser = scene.replace({"particles.grains.1.density": 8000.0, "particles.grains.0.sizes.radius": 1e-3})
    assert denser.particles.grains[1].density == 8000.0
    assert denser.particles.grains[0].sizes.radius == 1e-3
    assert denser.digest() != scene.digest()


WRONG = {
    "no bounds": (lambda: LognormalSizes(by="volume", median=1.0, ratio=1.5), "smallest must be given"),
    "upside down": (
        lambda: UniformSizes(by="number", smallest=2.0, largest=1.0),
        "uniform_sizes.largest must be above smallest; received 1",
    ),
    "nothing there": (
        lambda: NormalSizes(by="number", mean=1.0, deviation=1e-3, smallest=5.0, largest=6.0),
        "normal_sizes must be so that the law has sizes between smallest and largest",
    ),
    "sieves that fall": (
        lambda: SieveCurve(by="volume", diameters=(1.0, 2.0, 3.0), passing=(0.0, 0.5, 0.4)),
        "sieve_curve.passing must be from 0 to 1, never falling",
    ),
    "too few parts": (
        lambda: SieveCurve(by="volume", diameters=(1.0, 2.0), passing=(0.0, 0.5, 1.0)),
        "sieve_curve.passing must be 2, one for each sieve; received 3",
    ),
    "both": (
        lambda: Cloud(number=1, radius=1.0, density=1.0, grains=MIXTURE),
        "cloud must be given radius and density, or grains; received radius and density and grains",
    ),
    "a number for a material": (
        lambda: Cloud(
            number=1,
            grains=(GrainClass(sizes=EqualSizes(radius=1.0), density=1.0, quantities={"material": 1}),),
        ),
        "grains.0.quantities.material must be given once, and none that the grains have",
    ),
    "one class says more": (
        lambda: Cloud(number=1, grains=(MIXTURE[0], GrainClass(sizes=EqualSizes(radius=1.0), density=1.0))),
        "grains.1.quantities must be those of the other classes",
    ),
    "too full": (
        lambda: Cloud(
            number=400, grains=MIXTURE, placement=RandomInBox(low=(0, 0, 0), high=(0.01,) * 3)
        ).arrays(Open(), 0),
        r"volume fraction must be at most 0\.\d+, where no further sphere fits",
    ),
}


@pytest.mark.parametrize(("make", "message"), WRONG.values(), ids=WRONG)
def test_wrong_sizes_are_refused(make, message):
    with pytest.raises(InputError, match=message) as error_info:
        make()
    check_message(str(error_info.value))
