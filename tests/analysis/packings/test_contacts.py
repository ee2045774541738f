"""Gaps and contact numbers of lattices, against other narrow phases, and of bodies that touch themselves."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from tests.analysis.packings.lattices import CONTACTS, lattice, random_packing
from tisim import InputError
from tisim.analysis import PackedBodies, contact_numbers, near_gaps, radial_distribution
from tisim.shapes import EllipsoidShape, SphereShape, SpherocylinderShape, SuperquadricShape


@pytest.mark.parametrize("cells", [1, 3])
@pytest.mark.parametrize("name", list(CONTACTS))
def test_contacts_of_lattices(name, cells):
    """Also in a box of one cell, in which a sphere touches several images of another one, or of itself."""
    packing = lattice(name, cells, diameter=2e-3, low=(0.1, -0.2, 0.3))
    gaps = near_gaps(packing, 1e-9)
    assert 2 * len(gaps.pairs) == CONTACTS[name] * len(packing)
    np.testing.assert_allclose(gaps.gap, 0, atol=1e-15)
    np.testing.assert_allclose(gaps.separation, 2e-3 * gaps.normal, atol=1e-15)
    # Rotated lattices, and gaps to second neighbours: their number is compared with a large lattice.
    large = lattice(name, 5)
    edges = np.array([1.5, 2.3])
    expected = radial_distribution(large.position, edges, large.low, large.high, large.sides)
    shell = expected * (len(large) - 1) / large.box_volume * 4 / 3 * np.pi * np.diff(edges**3)
    gap = near_gaps(packing, 1.3 * 2e-3).gap
    assert 2 * (gap > 0.5 * 2e-3).sum() == pytest.approx(shell[0] * len(packing))


@pytest.mark.parametrize("periodic", [(True, True, True), (False, True, False)])
def test_gaps_of_rods_are_distances_of_segments(rng, periodic):
    """Of two sizes; each image of a pair counts, by a search over all."""
    rod = SpherocylinderShape(length=2.0, diameter=0.6)
    packing = random_packing(rng, rod, 40, 4.0, periodic)
    scale = np.where(rng.random(40) < 0.5, 1.0, 0.5)
    packing = PackedBodies.of(
        rod, packing.position, packing.low, packing.high, packing.orientation, scale, periodic
    )
    found = near_gaps(packing, 0.2)
    axes, expected = packing.axes()[:, 2], []
    steps = [(-1, 0, 1) if joined else (0,) for joined in periodic]
    shifts = 4.0 * np.stack(np.meshgrid(*steps, indexing="ij"), -1).reshape(-1, 3)
    for i in range(40):
        for j in range(i + 1, 40):
            for shift in shifts:
                away = packing.position[j] + shift - packing.position[i]
                if np.linalg.norm(away) > (scale[i] + scale[j]) * 1.3 + 0.2:
                    continue
                both = np.stack([axes[i], -axes[j]], axis=1)
                limit = np.array([scale[i], scale[j]])
                best = lsq_linear(both, away, (-limit, limit), method="bvls", tol=1e-14)
                gap = np.sqrt(2 * best.cost) - 0.3 * limit.sum()
                if gap <= 0.2:
                    expected.append((i, j, gap))
    expected = np.array(sorted(expected))
    assert len(expected) > 60
    rows = np.column_stack([found.pairs, found.gap])
    rows = rows[np.lexsort(rows.T[::-1])]
    np.testing.assert_allclose(rows, expected, atol=1e-7)


def test_ellipsoids_that_are_stretched_spheres_touch_as_these(rng):
    """A lattice stretched along z has the contacts of the lattice of spheres, with other gaps beyond."""
    spheres = lattice("fcc", 2)
    stretch = np.array([1.0, 1.0, 1.7])
    shape = EllipsoidShape(semi_axes=tuple(0.5 * stretch))
    packing = PackedBodies.of(shape, spheres.position * stretch, spheres.low, spheres.high * stretch)
    assert len(near_gaps(packing, 1e-9).pairs) == 6 * len(packing)
    # In a turned frame the same: a body turned by 90 degrees about x in a cell turned with it.
    quarter = Rotation.from_rotvec([np.pi / 2, 0, 0])
    turned = PackedBodies.of(
        shape,
        quarter.apply(packing.position) - [0, packing.low[2] - packing.high[2], 0],
        (0, 0, 0),
        packing.high[[0, 2, 1]],
        quarter.as_quat(scalar_first=True),
    )
    assert len(near_gaps(turned, 1e-9).pairs) == 6 * len(packing)


def test_superballs_in_a_cubic_lattice_touch_by_their_faces():
    packing = lattice("sc", 3, shape=SuperquadricShape(semi_axes=(0.5,) * 3, exponents=(6.0,) * 3))
    gaps = near_gaps(packing, 1e-9)
    assert 2 * len(gaps.pairs) == 6 * len(packing)
    np.testing.assert_allclose(np.abs(gaps.normal).max(axis=1), 1, rtol=1e-12)


def test_one_file_of_rods_touches_itself():
    """A single rod in a periodic box as long as itself: two contacts, both with its own image."""
    rod = SpherocylinderShape(length=3.0, diameter=1.0)
    packing = PackedBodies.of(rod, [[0, 0, 1.0]], (-1, -1, 0), (1, 1, 4.0), periodic=(False, False, True))
    numbers = contact_numbers(packing)
    np.testing.assert_array_equal(numbers.mean, 2.0)
    assert numbers.rattlers[0] == 1
    assert np.isnan(numbers.held_mean).all()
    assert contact_numbers(packing, fewest=2).held_mean[-1] == 2.0


def test_contact_numbers_are_extrapolated_to_contact(rng):
    """Half of the neighbours along x are moved away by up to 1e-5 of D: the number grows linearly with the
    cut-off, from the number of true contacts."""
    number, diameter = 4000, 2e-3
    gap = 1e-5 * diameter * (np.arange(number) + 0.5) / number
    order = rng.permutation(number)
    # Pairs of spheres, each far from others; every other pair touches exactly.
    x = np.zeros((2 * number, 2))
    x[:number, 1], x[number:, 1] = diameter + gap[order], diameter
    position = np.zeros((4 * number, 3))
    position[:, 0], position[:, 1] = x.ravel(), np.repeat(np.arange(2 * number), 2) * 3 * diameter
    packing = PackedBodies.of(
        SphereShape(diameter=diameter),
        position,
        (-1, -1, -1),
        (1, 6 * number * diameter + 1, 1),
        periodic=(False, False, False),
    )
    numbers = contact_numbers(packing)
    assert numbers.cutoff[0] == pytest.approx(1e-8)
    assert numbers.at_contact.value == pytest.approx(0.5, abs=2e-4)
    assert numbers.at_contact.half < 4e-4
    expected = 0.5 + 0.5 * numbers.cutoff / 1e-5
    np.testing.assert_allclose(numbers.mean, expected, atol=2e-4)


def test_rattlers_are_left_out():
    """A sphere in a hole of a cubic lattice rattles: it has one contact, of which its neighbour knows."""
    crystal = lattice("sc", 3)
    hole = crystal.position[0] + 0.5
    direction = np.array([1.0, 1, 1]) / np.sqrt(3)
    loose = hole - (np.sqrt(3) / 2 - 0.5 - 0.2) * direction
    scale = np.append(np.ones(27), 0.4)
    packing = PackedBodies.of(
        SphereShape(diameter=1.0),
        np.vstack([crystal.position, loose]),
        crystal.low,
        crystal.high,
        scale=scale,
    )
    numbers = contact_numbers(packing)
    assert (numbers.rattlers == 1).all()
    np.testing.assert_allclose(numbers.mean, (6 * 27 + 2) / 28)
    np.testing.assert_array_equal(numbers.held_mean, 6.0)
    assert numbers.held_at_contact.value == pytest.approx(6.0)


def test_wrong_packings_are_refused():
    ball, one = SphereShape(diameter=1.0), lattice("sc", 2)
    with pytest.raises(InputError, match="scale must be above 0; received 0"):
        PackedBodies.of(ball, one.position, one.low, one.high, scale=0.0)
    with pytest.raises(InputError, match="orientation must be unit quaternions"):
        PackedBodies.of(ball, one.position, one.low, one.high, orientation=(1, 1, 0, 0))
    with pytest.raises(InputError, match="low must be below high along all axes"):
        PackedBodies.of(ball, one.position, one.high, one.low)
    with pytest.raises(InputError, match="cutoffs must be at least three different numbers from 0 on"):
        contact_numbers(one, [1e-5, 1e-6])
    kinds = np.arange(8) % 2
    with pytest.raises(InputError, match="shape must be indices below 1"):
        PackedBodies(one.position, one.orientation, kinds, one.scale, (ball,), one.low, one.high)
