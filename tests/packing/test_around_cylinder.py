"""Initial states in a layer around a cylinder."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tisim import InputError, Open, RandomAroundCylinder

CYLINDER = {
    "centre": (1.0, 2.0, 3.0),
    "axis": (1.0, 2.0, 2.0),
    "radius": 0.5,
    "length": 3.0,
    "thickness": 0.4,
}


def cylindrical(points):
    """Distance from the axis and from the middle plane."""
    axis, offset = np.array([1.0, 2.0, 2.0]) / 3, points - [1.0, 2.0, 3.0]
    z = offset @ axis
    return np.linalg.norm(offset - z[:, None] * axis, axis=1), np.abs(z)


@pytest.mark.parametrize("part", ["all", "top", "side"])
def test_spheres_lie_inside_their_layer_and_fill_it_uniformly(part):
    radius, number = 0.002, 4000
    placement = RandomAroundCylinder(**CYLINDER, part=part)
    points = placement.centres(np.full(number, radius), Open(), 1)
    rho, z = cylindrical(points)
    assert len(points) == number
    assert len(cKDTree(points).query_pairs(2 * radius * (1 - 1e-12))) == 0
    assert ((rho <= 0.9 - radius) & (z <= 1.9 - radius)).all()
    beyond = z > 1.5
    outside = np.hypot(np.maximum(rho - 0.5, 0.0), np.maximum(z - 1.5, 0.0))
    assert outside.min() >= radius * (1 - 1e-9)
    share = placement.model_copy(update={"part": "top"}).volume() / placement.volume()
    expected = {"all": share, "top": 1.0, "side": 0.0}[part]
    assert beyond.mean() == pytest.approx(expected, abs=4 * np.sqrt(0.25 / number))
    # The distribution is uniform in the squared distance from the axis.
    low = 0.0 if part == "top" else 0.25
    squares = rho[beyond == (part == "top")] ** 2
    assert squares.mean() == pytest.approx((low + 0.81) / 2, rel=0.02)


def test_volumes():
    placement = RandomAroundCylinder(**CYLINDER)
    assert placement.volume() == pytest.approx(np.pi * (0.81 * 3.8 - 0.25 * 3.0))
    parts = [RandomAroundCylinder(**CYLINDER, part=part).volume() for part in ("top", "side")]
    assert sum(parts) == pytest.approx(placement.volume())


@pytest.mark.parametrize("part", ["all", "top", "side"])
def test_a_thin_layer_around_a_long_cylinder_is_filled(part):
    placement = RandomAroundCylinder(radius=1.0, length=40.0, thickness=1e-3, part=part)
    points = placement.centres(np.full(200, 1e-4), Open(), 0)
    assert len(points) == 200


@pytest.mark.slow
def test_no_room():
    with pytest.raises(InputError, match="thickness must be above a diameter"):
        RandomAroundCylinder(**CYLINDER).centres(np.full(1, 0.3), Open(), 0)
    with pytest.raises(InputError, match="length must be above a diameter"):
        RandomAroundCylinder(**{**CYLINDER, "length": 0.1}, part="side").centres(np.full(1, 0.1), Open(), 0)
    with pytest.raises(
        InputError, match=r"cloud.number must be at most the number that fits around the cylinder"
    ):
        RandomAroundCylinder(**CYLINDER).centres(np.full(1500, 0.1), Open(), 0)
    with pytest.raises(InputError, match=r"fits around the cylinder, less than 1746; received 2000"):
        RandomAroundCylinder(**CYLINDER).centres(np.full(2000, 0.1), Open(), 0)
    with pytest.raises(InputError, match="axis must be a direction"):
        RandomAroundCylinder(**{**CYLINDER, "axis": (0.0, 0.0, 0.0)})
