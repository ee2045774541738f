"""Bond order of lattices and of an icosahedron, whose values are in the literature."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import eval_legendre

from tests.analysis.packings.lattices import CELLS, lattice, random_packing
from tisim import InputError
from tisim.analysis import (
    PackedBodies,
    bond_order,
    contact_bonds,
    voronoi_bonds,
    voronoi_facets,
    voronoi_volumes,
)
from tisim.shapes import SphereShape

# Touching neighbours; Mickel et al. (2013), table I.
EXPECTED = {"sc": (0.7638, 0.3536), "bcc": (0.5092, 0.6285), "fcc": (0.1909, 0.5745), "hcp": (0.0972, 0.4848)}


@pytest.mark.parametrize("name", list(CELLS))
def test_touching_spheres_of_lattices(name):
    packing = lattice(name, 2, diameter=2e-3)
    bonds = contact_bonds(packing, 1e-9)
    for degree, expected in zip((4, 6), EXPECTED[name], strict=True):
        found = bond_order(len(packing), bonds, degree)
        np.testing.assert_allclose(found.local, expected, atol=6e-5)
        # In hcp bodies of two layers differ by a reflection, and their bonds do not add up.
        assert found.whole <= expected + 1e-4
        if name != "hcp":
            assert found.whole == pytest.approx(expected, abs=6e-5)


def test_bcc_with_its_second_neighbours():
    packing = lattice("bcc", 3)
    bonds = contact_bonds(packing, 0.2)
    found = bond_order(len(packing), bonds, 4), bond_order(len(packing), bonds, 6)
    assert set(found[0].neighbours) == {14}
    np.testing.assert_allclose(found[0].local, 0.0364, atol=6e-5)
    np.testing.assert_allclose(found[1].local, 0.5107, atol=6e-5)


def test_an_icosahedron_in_any_frame(rng):
    golden = (1 + np.sqrt(5)) / 2
    corners = np.array([[0, a, b * golden] for a in (-1, 1) for b in (-1, 1)], float)
    around = np.vstack([np.roll(corners, k, axis=1) for k in range(3)]) / np.hypot(1, golden)
    position = Rotation.random(rng=rng).apply(np.vstack([np.zeros((1, 3)), around]))
    packing = PackedBodies.of(SphereShape(diameter=1.0), position, (-9,) * 3, (9,) * 3, periodic=(False,) * 3)
    bonds = contact_bonds(packing, 1e-9)
    for degree in (2, 4, 6, 8, 10, 12):
        # By the addition theorem of spherical harmonics: angles of 0, 63.4, 116.6 and 180 degrees.
        cosine = np.array([1] + 5 * [1 / np.sqrt(5)] + 5 * [-1 / np.sqrt(5)] + [-1])
        expected = np.sqrt(abs(eval_legendre(degree, cosine).mean()))
        assert bond_order(13, bonds, degree).local[0] == pytest.approx(expected, abs=1e-7)
    assert bond_order(13, bonds, 4).local[0] == pytest.approx(0, abs=1e-7)
    assert bond_order(13, bonds, 6).local[0] == pytest.approx(0.66332, abs=1e-5)


def test_random_bonds_have_no_order(rng):
    packing = random_packing(rng, SphereShape(diameter=0.1), 3000, 1.0)
    bonds = contact_bonds(packing, 0.02)
    whole = [bond_order(3000, bonds, degree).whole for degree in (2, 4, 6, 8, 10)]
    number = len(bonds.body) / 2
    assert np.sqrt(np.mean(np.square(whole))) == pytest.approx(1 / np.sqrt(number), rel=0.5)
    alone = packing.where(np.arange(1))
    assert np.isnan(bond_order(1, contact_bonds(alone, 0.01), 6).local[0])
    assert np.isnan(bond_order(1, contact_bonds(alone, 0.01), 6).whole)
    with pytest.raises(InputError, match="degree must be an even whole number, at least 2; received 3"):
        bond_order(3000, bonds, 3)


def test_facets_of_cells(rng):
    """They close, fill the box, and come from both sides; a slightly disturbed lattice has its facets."""
    packing = random_packing(rng, SphereShape(diameter=0.1), 60, 1.3, (True, True, True))
    facets = voronoi_facets(packing.position, packing.sides)
    volume = facets.area * np.linalg.norm(facets.separation, axis=1) / 6
    np.testing.assert_allclose(
        np.bincount(facets.particle, volume), voronoi_volumes(packing.position, packing.sides), rtol=1e-9
    )
    normals = facets.separation / np.linalg.norm(facets.separation, axis=1, keepdims=True)
    for axis in normals.T:
        np.testing.assert_allclose(np.bincount(facets.particle, axis * facets.area), 0, atol=1e-12)
    away = packing.position[facets.neighbour] - packing.position[facets.particle] - facets.separation
    np.testing.assert_allclose(away / 1.3, np.round(away / 1.3), atol=1e-9)
    rows = np.column_stack([facets.particle, facets.neighbour, np.round(facets.area, 10)])
    assert {tuple(row) for row in rows} == {(j, i, area) for i, j, area in rows}


@pytest.mark.parametrize(("name", "expected"), [("fcc", (0.1909, 0.5745)), ("hcp", (0.0972, 0.4848))])
def test_voronoi_neighbours_of_close_packings(rng, name, expected):
    """Far neighbours have tiny facets, which do not change the order."""
    packing = lattice(name, 3)
    moved = packing.position + 1e-4 * rng.normal(size=packing.position.shape)
    moved = PackedBodies.of(packing.shapes[0], moved, packing.low, packing.high)
    bonds = voronoi_bonds(moved)
    for degree, value in zip((4, 6), expected, strict=True):
        np.testing.assert_allclose(bond_order(len(moved), bonds, degree).local, value, atol=2e-3)
