"""Containers: distances from their walls, volumes, and uniformly distributed points, by brute force."""

import numpy as np
import pytest
from scipy.stats import ks_2samp

from tisim import InputError
from tisim.geometry import BoxContainer, CylindricalContainer, SphericalContainer, WedgeContainer
from tisim.geometry.container import Container

ANGLE = np.radians(25)
UNIT = 0.3
"""D, m."""
SIDE = np.array([2.0, 2.0, 2.0])
CONTAINERS = {
    "cylinder": CylindricalContainer(diameter=5.0),
    "sphere": SphericalContainer(),
    "wedge": WedgeContainer(length=6.0, angle=ANGLE),
    "cube": BoxContainer(),
    "duct": BoxContainer(hard=(True, True, False), width=(3.0, 0.0, 0.0)),
}
every_container = pytest.mark.parametrize("name", CONTAINERS)


def inside(name, p):
    """Whether points are inside, by the definition of each container."""
    x, y, z = p.T
    return {
        "cylinder": (x - 1) ** 2 + (y - 1) ** 2 < 0.75**2,
        "sphere": (x - 1) ** 2 + (y - 1) ** 2 + (z - 1) ** 2 < 1,
        "wedge": (y > 0) & (y < x * np.tan(ANGLE)) & (x < 1.8),
        "cube": (np.abs(p - 1) < 1).all(axis=1),
        "duct": (np.abs(x - 1) < 0.45) & (np.abs(y - 1) < 1),
    }[name]


def within(name, number, rng):
    """Points inside, by rejection."""
    points = SIDE * rng.uniform(size=(100 * number, 3))
    return points[inside(name, points)][:number]


@every_container
def test_distances_lead_to_the_nearest_points_of_the_walls(name, rng):
    """Along the normal a point is inside up to the distance; in no direction does it leave earlier."""
    container, places = CONTAINERS[name], within(name, 200, rng)
    distance, outward = container.distances(places, SIDE, UNIT)
    assert distance.shape == (200, container.walls())
    np.testing.assert_allclose(np.linalg.norm(outward, axis=2), 1.0, rtol=1e-14)
    nearest = distance.argmin(axis=1)
    least, normal = distance.min(axis=1), outward[np.arange(200), nearest]
    assert least.min() > 0
    for part, there in ((1 - 1e-9, True), (1 + 1e-9, False)):
        assert (inside(name, places + (part * least)[:, None] * normal) == there).all()
    for _ in range(200):
        direction = rng.normal(size=(200, 3))
        # Along periodic axes there is no wall.
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        assert inside(name, places + ((1 - 1e-9) * least)[:, None] * direction).all()
    # Behind a wall the distance is negative, and the normal the same.
    behind = places + (2 * least)[:, None] * normal
    far, same = container.distances(behind, SIDE, UNIT)
    np.testing.assert_allclose(far[np.arange(200), nearest], -least, rtol=0, atol=1e-12)
    np.testing.assert_allclose(same[np.arange(200), nearest], normal, rtol=0, atol=1e-9)


@every_container
def test_volumes_agree_with_random_points(name, rng):
    container = CONTAINERS[name]
    share = inside(name, SIDE * rng.uniform(size=(400_000, 3))).mean()
    error = np.sqrt((1 - share) * share / 400_000) * 8
    volume = container.volume_in(SIDE, UNIT)
    assert volume == pytest.approx(8 * share, abs=5 * error)
    assert container.volume_in(container.box_of(volume, UNIT), UNIT) == pytest.approx(volume, rel=1e-14)


@every_container
@pytest.mark.parametrize("margin", [0.0, 0.13])
def test_points_are_uniform_over_all_that_are_far_enough_from_walls(name, margin, rng):
    container = CONTAINERS[name]
    points = container.points(rng.uniform(size=(4000, 3)), SIDE, UNIT, margin)
    assert container.distances(points, SIDE, UNIT)[0].min() > margin - 1e-12
    others = within(name, 20_000, rng)
    others = others[container.distances(others, SIDE, UNIT)[0].min(axis=1) >= margin]
    # Along eight directions.
    for direction in rng.normal(size=(8, 3)):
        assert ks_2samp(points @ direction, others @ direction).pvalue > 1e-4


def test_a_point_on_the_axis_has_a_normal():
    for name in ("cylinder", "sphere"):
        distance, outward = CONTAINERS[name].distances(np.array([[1.0, 1.0, 1.0]]), SIDE, UNIT)
        assert distance[0, 0] == pytest.approx({"cylinder": 0.75, "sphere": 1.0}[name])
        assert outward[0, 0].tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CylindricalContainer(diameter=0.9), "cylindrical_container.diameter must be .*1"),
        (lambda: WedgeContainer(length=2.0, angle=0.5), "wedge_container.length must be at least 2.45816 D"),
        (lambda: WedgeContainer(length=9.0, angle=1.6), "wedge_container.angle must be"),
        (lambda: BoxContainer(hard=(False,) * 3), "box_container.hard must be true for at least one axis"),
        (
            lambda: BoxContainer(hard=(True, False, False), width=(0.0, 2.0, 0.0)),
            "box_container.width must be 0, or at least 1 D along an axis with hard faces",
        ),
        (lambda: BoxContainer(width=(0.5, 0.0, 0.0)), "box_container.width must be 0, or at least 1 D"),
        (lambda: BoxContainer(width=(2.0, 2.0, 2.0)), "box_container.width must be 0 along one axis"),
        (lambda: SphericalContainer().check_box(np.array([1.0, 1.0, 1.1])), "domain must be a cube around"),
    ],
)
def test_containers_that_hold_no_body_or_cannot_contract_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


@every_container
def test_the_triangles_of_a_picture_lie_on_the_walls_and_cover_them(name):
    """Corners lie on a wall and are not behind another; the area is that of all walls."""
    container = CONTAINERS[name]
    triangles = container.triangles(SIDE, UNIT)
    distance, _ = container.distances(triangles.reshape(-1, 3), SIDE, UNIT)
    np.testing.assert_allclose(distance.min(axis=1), 0, atol=1e-12)
    sides = triangles[:, 1:] - triangles[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    expected = {
        "cylinder": np.pi * 1.5 * 2,
        "sphere": 4 * np.pi,
        "wedge": 1.8 * (1 + np.tan(ANGLE) + 1 / np.cos(ANGLE)) * 2,
        "cube": 24.0,
        "duct": 2 * (2 * 2) + 2 * (0.9 * 2),
    }[name]
    assert area == pytest.approx(expected, rel=2e-3)


def test_a_container_that_does_not_say_how_it_looks_has_no_triangles():
    assert Container().triangles(SIDE, UNIT).shape == (0, 3, 3)
