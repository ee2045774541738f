"""Images of pores, their sizes, diffusion through them, and permeability."""

import numpy as np
import pytest

from tests.analysis.packings.lattices import FRACTION, lattice
from tisim import InputError
from tisim.analysis import (
    PackedBodies,
    packing_diffusion,
    permeability,
    pore_diffusion,
    pore_image,
    pore_sizes,
    specific_surface,
)
from tisim.shapes import SphereShape, SpherocylinderShape, SuperquadricShape

ROD = SpherocylinderShape(length=4.0, diameter=1.0)


def test_the_image_of_a_lattice_has_its_porosity():
    image = pore_image(lattice("fcc", 1, diameter=2e-3, low=(1.0, 2.0, 3.0)), 2e-3 / 20)
    assert image.shape == (28, 28, 28)
    assert 1 - image.mean() == pytest.approx(FRACTION["fcc"], abs=0.01)
    # Another frame gives the same voxels, moved.
    image = pore_image(lattice("sc", 1), 0.1)
    corner = ~image[0, 0, 0]
    assert corner
    assert image[5, 5, 5]


def test_pores_of_a_cubic_lattice():
    """In the centre of a cell there is room for a sphere of sqrt(3) - 1."""
    expected, sizes = 2e-3 * (np.sqrt(3) - 1), pore_sizes(lattice("sc", 1, diameter=2e-3), 2e-3 / 41)
    assert sizes.diameter[-1] == pytest.approx(expected, abs=2e-3 / 41)
    # With an even number no voxel is in the centre.
    even = pore_sizes(lattice("sc", 1, diameter=2e-3), 2e-3 / 40)
    assert even.diameter[-1] == pytest.approx(expected, abs=2.5 * 2e-3 / 40)
    assert even.mean == pytest.approx(sizes.mean, rel=0.13)
    assert sizes.share.sum() == pytest.approx(1)
    assert sizes.quantile(1.0) == sizes.diameter[-1]
    assert sizes.quantile(0.0) == sizes.diameter[0]
    assert sizes.diameter[0] < sizes.mean < sizes.diameter[-1]
    # This sphere alone is 0.43 of the pores; others around it are nearly as large.
    largest = sizes.share[sizes.diameter > sizes.diameter[-1] - 2 * 2e-3 / 41].sum()
    assert largest > np.pi / 6 * (np.sqrt(3) - 1) ** 3 / (1 - np.pi / 6) - 0.02


def test_a_slit_between_walls_of_rods_has_its_width():
    """Rods side by side are a wall with grooves, 3 apart at the narrowest."""
    position = [[0.5, 2.5, 2.0]]
    box = (0, 0, 0), (1, 5, 4)
    along_z = PackedBodies.of(ROD, position, *box)
    sizes = pore_sizes(along_z, 0.1)
    assert sizes.quantile(0.5) == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize("periodic", [(True, True, True), (True, True, False)])
def test_straight_channels_have_no_tortuosity(periodic):
    """Along z 12 of 80 voxels are pores; across there is no way."""
    image = np.zeros((8, 10, 6), bool)
    image[2:5, 3:7] = True
    found = pore_diffusion(image, 2, periodic)
    assert found.porosity == pytest.approx(0.15)
    assert found.relative == pytest.approx(0.15, rel=1e-6)
    assert found.tortuosity == pytest.approx(1, rel=1e-6)
    across = pore_diffusion(image, 0, periodic)
    assert across.relative == 0
    assert np.isinf(across.tortuosity)
    # A pore without an exit is part of the porosity, and not of the flux.
    image[0, 0, 2] = True
    assert pore_diffusion(image, 2, periodic).relative == pytest.approx(0.15, rel=1e-6)


def test_an_inclined_channel_has_the_square_of_its_length():
    """A channel at 45 degrees, 30 voxels wide along z: tau is 2, the square of sqrt(2)."""
    n, width = 60, 30
    z, x = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    image = ((x - z) % n < width)[:, None, :]
    found = pore_diffusion(image, 0, (True, True, True))
    assert found.tortuosity == pytest.approx(2, rel=0.05)


def test_spheres_of_a_cubic_lattice_obstruct_as_rayleigh_found():
    """D_eff/D = 1 - 3 phi/(2 + phi - 0.98 phi^(10/3)), at phi = 0.3."""
    phi = 0.3
    diameter = (6 * phi / np.pi) ** (1 / 3)
    packing = PackedBodies.of(SphereShape(diameter=diameter), [[0.5, 0.5, 0.5]], (0, 0, 0), (1, 1, 1))
    expected = 1 - 3 * phi / (2 + phi - 0.98 * phi ** (10 / 3))
    errors = [pore_diffusion(pore_image(packing, 1 / n)).relative - expected for n in (16, 32, 48)]
    assert np.abs(errors[2]) < 0.012
    assert np.abs(errors[2]) < np.abs(errors[0])


def test_the_limit_of_small_voxels_is_closer_to_rayleigh():
    """27 spheres of the lattice, each at another place among the voxels, 11 of which are across a sphere. No
    pores lead through the gaps of touching cubes."""
    phi = 0.3
    diameter = (6 * phi / np.pi) ** (1 / 3)
    places = np.stack(np.meshgrid(*3 * [np.arange(3) + 0.5], indexing="ij"), -1).reshape(-1, 3)
    packing = PackedBodies.of(SphereShape(diameter=diameter), places, (0, 0, 0), (3, 3, 3))
    expected = 1 - 3 * phi / (2 + phi - 0.98 * phi ** (10 / 3))
    spacing = 3 / 40
    found = packing_diffusion(packing, spacing, 0)
    assert found.relative == pytest.approx(expected, rel=0.02)
    assert found.tortuosity == pytest.approx(found.porosity / found.relative)
    assert found.porosity == pytest.approx(1 - phi, abs=0.005)
    assert pore_diffusion(pore_image(packing, spacing), 0).relative < 0.96 * expected
    cube = SuperquadricShape(semi_axes=(0.5, 0.5, 0.5), exponents=(20.0, 20.0, 20.0))
    closed = PackedBodies.of(cube, places, (0, 0, 0), (3, 3, 3))
    assert packing_diffusion(closed, 0.1).relative == 0
    assert np.isinf(packing_diffusion(closed, 0.1).tortuosity)


def test_images_that_cannot_be_extrapolated_are_refused():
    """Overlapping spheres of 1.3 leave openings that the larger voxels close; a lattice without bodies in its
    whole height has the same diffusion in images whose numbers of voxels are not 2 to 1."""
    places = np.stack(np.meshgrid(*3 * [np.arange(3) + 0.5], indexing="ij"), -1).reshape(-1, 3)
    narrow = PackedBodies.of(SphereShape(diameter=1.3), places, (0, 0, 0), (3, 3, 3))
    with pytest.raises(InputError, match=r"^spacing must be small enough that .* received 0.05"):
        packing_diffusion(narrow, 0.05)
    opened = PackedBodies.of(
        SphereShape(diameter=1.0), places, (0, 0, 0), (3, 3, 3), periodic=(True, True, False)
    )
    with pytest.raises(InputError, match=r"^periodic must be true along all axes"):
        packing_diffusion(opened, 0.1)


def test_sides_of_voxels_in_another_ratio_than_two():
    """A box of 11 voxels has 6 of about twice the side; the exact ratio extrapolates as 12 and 6 do."""
    sphere = PackedBodies.of(SphereShape(diameter=0.8), [[0.5, 0.5, 0.5]], (0, 0, 0), (1, 1, 1))
    fine, coarse = (pore_diffusion(pore_image(sphere, 1 / n)).relative for n in (11, 6))
    expected = fine + (fine - coarse) / (11 / 6 - 1)
    assert packing_diffusion(sphere, 1 / 11).relative == pytest.approx(expected, rel=1e-12)


def test_cylinders_across_the_flux_obstruct_as_rayleigh_found():
    """D_eff/D = 1 - 2 phi/(1 + phi - 0.3058 phi^4), in a slab one voxel thick."""
    n, phi = 150, 0.5
    x = (np.arange(n) + 0.5) / n - 0.5
    image = (np.hypot(*np.meshgrid(x, x, indexing="ij")) > np.sqrt(phi / np.pi))[:, :, None]
    phi = 1 - image.mean()
    expected = 1 - 2 * phi / (1 + phi - 0.3058 * phi**4)
    assert pore_diffusion(image, 0).relative == pytest.approx(expected, abs=0.006)
    # The faces of an open axis are planes of equal concentration in the periodic lattice too.
    opened = pore_diffusion(image, 0, (False, True, True)).relative
    assert opened == pytest.approx(pore_diffusion(image, 0).relative, rel=1e-4)


def test_permeability_of_spheres_and_rods():
    """(1 - phi)^3 D^2/(180 phi^2) for spheres; specific surface 6 phi/D."""
    diameter = 2e-3
    packing = lattice("fcc", 2, diameter=diameter)
    phi = np.pi / np.sqrt(18)
    assert specific_surface(packing) == pytest.approx(6 * phi / diameter, rel=1e-13)
    assert permeability(packing) == pytest.approx((1 - phi) ** 3 * diameter**2 / (180 * phi**2), rel=1e-12)
    assert permeability(packing, 10.0) == pytest.approx(permeability(packing) / 2, rel=1e-12)
    rods = PackedBodies.of(ROD, [[2, 2, 2]], (0, 0, 0), (3, 3, 6), periodic=(False,) * 3)
    volume, surface = np.pi / 4 * (2 / 3 + 4), np.pi * 5
    phi = volume / 60
    assert permeability(rods, volume=60.0) == pytest.approx(
        (1 - phi) ** 3 * (volume / surface) ** 2 / 5 / phi**2
    )
    assert specific_surface(rods, 60.0) == pytest.approx(surface / 60)


def test_wrong_arguments_are_refused():
    packing = lattice("hcp", 1)
    with pytest.raises(InputError, match="sides of voxels must be equal within 1 % along all axes"):
        pore_image(packing, 0.3)
    with pytest.raises(InputError, match="image must be bool of three dimensions"):
        pore_diffusion(np.zeros((3, 3), bool))
    with pytest.raises(InputError, match="axis must be 0, 1 or 2; received 3"):
        pore_diffusion(np.zeros((3, 3, 3), bool), 3)
    assert np.isinf(pore_diffusion(np.zeros((3, 3, 3), bool)).tortuosity)
    with pytest.raises(InputError, match="bodies must be in the box, which is empty; received 0"):
        pore_sizes(packing.where(np.zeros(4, bool)), 0.02)
    with pytest.raises(InputError, match="packing fraction must be below 1"):
        permeability(packing, volume=1e-3)
