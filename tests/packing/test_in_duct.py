"""Initial states in a duct of varying width."""

import numpy as np
import pytest

from tisim import Box, Cloud, GrainClass, InputError, Open
from tisim.analysis import contacts
from tisim.packing import EqualSizes, RandomInDuct

DUCT = {"heights": (0.0, 3.0, 5.0, 6.0, 7.5, 10.0), "radii": (3.0, 3.0, 1.2, 1.2, 3.0, 3.0)}
SHORT = {"heights": (0.0, 0.02, 0.6, 9.0, 10.0), "radii": (3.0, 3.0, 0.8, 0.8, 3.0)}
"""A duct whose first part is so short that spheres at the upper face extend beyond it."""
LOW = (0.5, -0.5, -2.0)
AROUND = Box(low=(-4.0, -4.0, -2.0), high=(4.0, 4.0, 8.0), periodic=(False, False, True))


def off_wall(points, ends, duct=DUCT):
    """Distance of points from the profile, by samples of its lines, and whether the points are inside."""
    rho = np.hypot(points[:, 0] - LOW[0], points[:, 1] - LOW[1])
    z = points[:, 2] - LOW[2]
    places = np.linspace(-10.0, 20.0, 120001)
    heights = np.array(duct["heights"])
    wall = np.interp(places % 10.0, heights, duct["radii"])
    lines = np.stack([wall, places], axis=1)
    if ends:
        inside = (places >= 0) & (places <= 10)
        lines = lines[inside]
        across = np.linspace(0.0, 3.0, 12001)
        for height in (0.0, 10.0):
            lines = np.vstack([lines, np.stack([across, np.full(len(across), height)], axis=1)])
    distance = [np.hypot(*(lines - [a, b]).T).min() for a, b in zip(rho, z, strict=True)]
    return np.array(distance), rho < np.interp(z, heights, duct["radii"])


@pytest.mark.parametrize("domain", [AROUND, Open()])
@pytest.mark.parametrize("fraction", [0.1, 0.345])
def test_spheres_lie_inside_the_duct_without_overlap(domain, fraction):
    placement = RandomInDuct(centre=LOW, **DUCT)
    rng = np.random.default_rng(1)
    radii = rng.uniform(0.2, 0.4, 2000)
    volumes = np.cumsum(4 / 3 * np.pi * radii**3)
    radii = radii[volumes <= fraction * placement.volume()]
    points = placement.centres(radii, domain, 3)
    assert points.shape == (len(radii), 3)
    sides = (0.0, 0.0, 10.0 if domain is AROUND else 0.0)
    assert len(contacts(points, radii * (1 - 1e-9), sides=sides)) == 0
    distance, inside = off_wall(points, domain is not AROUND)
    assert inside.all()
    assert (distance >= radii - 1e-6).all()
    # Some spheres cross the periodic faces.
    z = points[:, 2] - LOW[2]
    assert ((z < radii) | (z > 10 - radii)).any() == (domain is AROUND)
    again = placement.centres(radii, domain, 3)
    assert (again == points).all()
    assert (placement.centres(radii, domain, 4) != points).any()


def test_spheres_are_off_the_wall_beyond_a_short_part_at_the_face():
    radii = np.full(12, 0.5)
    for seed in range(6):
        points = RandomInDuct(centre=LOW, **SHORT).centres(radii, AROUND, seed)
        distance, inside = off_wall(points, False, SHORT)
        assert inside.all()
        assert (distance >= radii - 1e-6).all()


def test_few_small_spheres_are_uniform_in_the_duct():
    placement = RandomInDuct(**DUCT)
    points = placement.centres(np.full(4000, 0.005), Open(), 0)
    a, b = 3.0, 1.2
    cone = np.pi / 3 * (a * a + a * b + b * b)
    volume = 9 * np.pi * 5.5 + cone * 3.5 + 1.44 * np.pi
    assert placement.volume() == pytest.approx(volume)
    below = (points[:, 2] < 3).mean()
    assert below == pytest.approx(27 * np.pi / volume, abs=4 * np.sqrt(0.25 / 4000))
    # In the straight part the distribution is uniform in the squared distance from the axis.
    squares = (points[points[:, 2] < 3, :2] ** 2).sum(axis=1)
    assert squares.mean() == pytest.approx(4.5, rel=0.05)


def test_the_seed_determines_the_cloud():
    cloud = Cloud(
        number=50,
        grains=[GrainClass(sizes=EqualSizes(radius=0.3), density=2.0)],
        placement=RandomInDuct(centre=LOW, **DUCT),
    )
    first, second = cloud.arrays(AROUND, 0)["position"], cloud.arrays(AROUND, 1)["position"]
    assert first.shape == second.shape
    assert (first != second).any()


WRONG = {
    "random_in_duct.heights must be two or more; received 1": {"heights": (0.0,), "radii": (1.0,)},
    r"random_in_duct.heights must be rising from 0; received \(0.1": {
        "heights": (0.1, 1.0),
        "radii": (1.0, 1.0),
    },
    "random_in_duct.heights must be rising from 0": {"heights": (0.0, 0.0), "radii": (1.0, 1.0)},
    "random_in_duct.radii must be 2, one for each height; received 1": {
        "heights": (0.0, 1.0),
        "radii": (1.0,),
    },
    "random_in_duct.radii must be above 0": {"heights": (0.0, 1.0), "radii": (1.0, 0.0)},
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_ducts_are_refused(message):
    with pytest.raises(InputError, match=message):
        RandomInDuct(**WRONG[message])


def test_packings_without_space_are_refused():
    placement = RandomInDuct(centre=LOW, **DUCT)
    with pytest.raises(InputError, match=r"volume fraction must be at most 0\.5 in a duct"):
        placement.centres(np.full(3000, 0.3), AROUND, 0)
    with pytest.raises(InputError, match=r"duct must be wider than a sphere, 2\.6 m; received 2\.4"):
        placement.centres(np.full(1, 1.3), AROUND, 0)
    taller = Box(low=(-4.0, -4.0, -2.0), high=(4.0, 4.0, 9.0), periodic=(False, False, True))
    with pytest.raises(
        InputError, match=r"length of the duct must be 11 m, the side of the box along z, which is"
    ):
        placement.centres(np.full(1, 0.3), taller, 0)
    stepped = RandomInDuct(centre=LOW, heights=(0.0, 10.0), radii=(1.0, 3.0))
    rule = r"duct\.radii must be equal at both ends in a box that is periodic along z; received \(1\."
    with pytest.raises(InputError, match=rule):
        stepped.centres(np.full(3, 0.4), AROUND, 0)
    assert stepped.centres(np.full(3, 0.4), Open(), 0).shape == (3, 3)
    with pytest.raises(InputError, match="places in the duct must be so near the origin"):
        RandomInDuct(centre=(0.0, 0.0, 1e17), **DUCT).centres(np.full(1, 0.3), Open(), 0)
