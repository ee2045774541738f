"""Rods at planes and in a cylinder, and histograms of directions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tisim import InputError
from tisim.analysis import PackedBodies, direction_histogram, wall_alignment, wall_distances
from tisim.geometry import CylindricalSurface, Plane
from tisim.shapes import SpherocylinderShape

ROD = SpherocylinderShape(length=2e-3, diameter=1e-3)


def alignment(packing, walls, **settings):
    """Of shapes of tisim.geometry."""
    return wall_alignment(packing, *wall_distances(packing.position, walls), **settings)


def along(directions):
    """Quaternions that turn z to directions."""
    turns = [Rotation.align_vectors([d], [[0, 0, 1]])[0] for d in np.asarray(directions, float)]
    return Rotation.concatenate(turns).as_quat(scalar_first=True)


def lean(degrees):
    """A direction that is some degrees out of the plane z = 0."""
    return np.cos(np.radians(degrees)), 0.0, np.sin(np.radians(degrees))


def test_rods_at_planes():
    """Along x at a wall, 3.9 and 4.1 degrees out of it, beside it but too far away, and in a corner."""
    position = np.array([[5, 5, 0.5], [5, 5, 0.99], [5, 5, 0.9], [5, 5, 1.01], [0.6, 5, 0.6]]) * 1e-3
    directions = [(1, 0, 0), lean(3.9), lean(4.1), (1, 0, 0), (1, 0, 0)]
    box = (0, 0, 0), (10e-3, 10e-3, 10e-3)
    packing = PackedBodies.of(ROD, position, *box, along(directions), periodic=(False,) * 3)
    walls = Plane(), Plane(normal=(2.0, 0, 0))
    found = alignment(packing, walls)
    assert found.near.tolist() == [4, 1]
    assert found.aligned.tolist() == [3, 0]
    assert found.fraction == pytest.approx(3 / 5)
    assert found.with_any == pytest.approx(3 / 4)
    assert alignment(packing, walls, angle=4.2).aligned.tolist() == [4, 0]
    assert alignment(packing, walls, within=0.6e-3).near.tolist() == [2, 1]
    # A wall elsewhere has no rods.
    assert np.isnan(alignment(packing, [Plane(point=(0, 0, -1.0))]).fraction)


def test_rods_in_a_cylinder():
    """Along the axis and around it a rod is aligned, across the wall not, at any azimuth."""
    azimuth = np.arange(12) * 2 * np.pi / 12 + 0.1
    radial = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=1)
    around = np.cross([0, 0, 1], radial)
    upright = np.tile([0, 0, 1.0], (12, 1))
    position = np.concatenate([4.3e-3 * radial] * 3 + [3.9e-3 * radial])
    directions = np.concatenate([upright, around, radial, upright])
    packing = PackedBodies.of(
        ROD,
        position,
        (-5e-3, -5e-3, -1e-2),
        (5e-3, 5e-3, 1e-2),
        along(directions),
        periodic=(False, False, True),
    )
    wall = CylindricalSurface(start=(0, 0, -0.1), end=(0, 0, 0.1), radius=5e-3)
    distance, normal = wall_distances(position, [wall])
    np.testing.assert_allclose(distance[:36, 0], 0.7e-3, rtol=1e-12)
    np.testing.assert_allclose(np.abs((normal[:36, 0] * np.tile(radial, (3, 1))).sum(axis=1)), 1, rtol=1e-9)
    found = alignment(packing, [wall])
    assert (found.near[0], found.aligned[0]) == (36, 24)
    # 5 degrees from the tangent plane is too much, in the plane any direction is aligned.
    tilted = np.cos(0.3) * upright + np.sin(0.3) * around
    out = np.cos(np.radians(5)) * upright + np.sin(np.radians(5)) * radial
    packing = PackedBodies.of(
        ROD, position[:24], packing.low, packing.high, along(np.concatenate([tilted, out]))
    )
    assert alignment(packing, [wall]).aligned[0] == 12


def test_random_rods_are_aligned_by_chance(rng):
    turns = Rotation.random(20_000, rng=rng).as_quat(scalar_first=True)
    position = rng.uniform(0, 1e-2, (20_000, 3))
    packing = PackedBodies.of(ROD, position, (0, 0, 0), (1e-2,) * 3, turns, periodic=(False,) * 3)
    found = alignment(packing, [Plane(), Plane(point=(0, 0, 1e-2), normal=(0, 0, -1))])
    expected = np.sin(np.radians(4))
    deviation = np.sqrt(expected * (1 - expected) / found.near.sum())
    assert found.fraction == pytest.approx(expected, abs=3 * deviation)


@pytest.mark.parametrize("folded", [True, False])
def test_random_directions_are_uniform(rng, folded):
    axes = Rotation.random(90_000, rng=rng).apply([0, 0, 1.0])
    found = direction_histogram(axes, (5, 8), folded)
    assert found.density.shape == (5, 8)
    assert found.density.mean() == pytest.approx(1, rel=1e-12)
    assert found.deviation == pytest.approx(np.sqrt(39 / 90_000))
    assert np.std(found.density) == pytest.approx(found.deviation, rel=0.35)
    assert found.azimuth[[0, -1]] == pytest.approx((0, np.pi / 2) if folded else (-np.pi, np.pi))


def test_directions_are_in_their_bins():
    """B16's wedge: along the bottom, along a slope of 9 degrees, and along its width."""
    nine = np.radians(9.5)
    axes = np.array([[1, 0, 0], [-np.cos(nine), -np.sin(nine), 0], [0, 0, -1.0]])
    axes[0] = [np.cos(0.01), 0.01, -1e-3]
    found = direction_histogram(axes, (10, 10))
    cells = {(0, 0): 100 / 3, (0, 1): 100 / 3, (9, 0): 100 / 3}
    assert found.density.sum() == pytest.approx(100)
    for cell, value in cells.items():
        assert found.density[cell] == pytest.approx(value)
    # Unfolded, a vector and its opposite are one direction, and mirror images are two.
    pair = np.array([[0.6, 0.0, 0.8], [-0.6, 0.0, -0.8], [-0.6, 0.0, 0.8]])
    assert sorted(direction_histogram(pair, (4, 3), folded=False).density[3]) == [0, 4, 8]
    assert direction_histogram(pair, (4, 3)).density[3, 0] == pytest.approx(12)


def test_wrong_arguments_are_refused(rng):
    packing = PackedBodies.of(ROD, [[0, 0, 0]], (0, 0, 0), (1, 1, 1))
    with pytest.raises(InputError, match="walls must be at least one; received 0"):
        alignment(packing, [])
    with pytest.raises(InputError, match="angle must be between 0 and 90 degrees; received 90"):
        alignment(packing, [Plane()], angle=90)
    with pytest.raises(InputError, match=r"distance, normal must be of shapes \(1, walls\) and"):
        wall_alignment(packing, np.zeros((2, 1)), np.zeros((2, 1, 3)))
    with pytest.raises(InputError, match="bins must be two whole numbers, at least 1"):
        direction_histogram(packing.axes()[:, 2], (0, 3))
