"""Local thickness: bands, discs and balls, periodic edges, and the definition itself."""

import numpy as np
import pytest

from tisim import InputError
from tisim.analysis import local_thickness

PIXEL = 0.5e-6


def disc(number, diameter, dimensions=2):
    """An image with a disc, or a ball, of an odd diameter (pixels) in its middle."""
    axes = np.meshgrid(*dimensions * [np.arange(number) - number // 2], indexing="ij")
    return np.sum([one**2 for one in axes], axis=0) < (diameter / 2) ** 2


def test_a_band_has_its_width_and_so_has_the_gap():
    image = np.zeros((40, 30), bool)
    image[5:17] = True
    np.testing.assert_allclose(local_thickness(image, PIXEL)[image], 12 * PIXEL)
    # Periodic: 28 pixels lie between the band and its image.
    np.testing.assert_allclose(local_thickness(~image, PIXEL)[~image], 28 * PIXEL)
    assert (local_thickness(image, PIXEL)[~image] == 0).all()


def test_a_structure_across_an_edge_is_whole():
    image = np.zeros((40, 30), bool)
    image[:4] = image[-6:] = True
    np.testing.assert_allclose(local_thickness(image, PIXEL)[image], 10 * PIXEL)
    # Not periodic, the structures end at the edges only because the image does.
    found = local_thickness(image, PIXEL, periodic=False)
    np.testing.assert_allclose(found[[0, -1]], np.outer([8 * PIXEL, 12 * PIXEL], np.ones(30)))


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_disc_and_a_ball_have_their_diameter(dimensions):
    image = disc(31, 15, dimensions)
    found = local_thickness(image, PIXEL)
    assert found.max() == pytest.approx(15 * PIXEL, abs=PIXEL)
    # A few pixels at the rim lie in smaller discs only.
    assert np.median(found[image]) == pytest.approx(15 * PIXEL, abs=PIXEL)
    # Part of it lies beyond the edges of the image, and comes back at the other side.
    across = np.roll(image, 14, axis=tuple(range(dimensions)))
    np.testing.assert_array_equal(
        local_thickness(across, PIXEL), np.roll(found, 14, tuple(range(dimensions)))
    )


@pytest.mark.parametrize("periodic", [True, False])
def test_it_is_the_largest_disc_within_the_structure_that_contains_a_point(periodic):
    """The definition, by trial of the discs around all pixels of a random image."""
    side, rng = 21, np.random.default_rng(3)
    image = np.ones((side, side), bool)
    image[tuple(rng.integers(0, side, (2, 14)))] = False
    points = np.argwhere(np.ones_like(image))
    away = np.abs(points[:, None] - points[None])
    squared = ((np.minimum(away, side - away) if periodic else away) ** 2).sum(axis=2)
    # Radii in multiples of half a pixel.
    free = np.floor(2 * np.sqrt(squared[:, ~image.ravel()].min(axis=1))) / 2
    expected = [2 * free[row < free**2].max(initial=0) for row in squared]
    np.testing.assert_allclose(local_thickness(image, 1.0, periodic).ravel(), expected)


def test_pixels_far_beyond_the_edges_count():
    """A single hole in a large image: the largest disc touches four of its images, wherever the hole is."""
    image = np.ones((50, 50), bool)
    image[25, 25] = False
    found = local_thickness(image, 1.0)
    assert found.max() == pytest.approx(50 * np.sqrt(2), abs=1)
    for shift in (3, 24):
        moved = np.roll(image, (shift, -shift), (0, 1))
        np.testing.assert_array_equal(local_thickness(moved, 1.0), np.roll(found, (shift, -shift), (0, 1)))


def test_no_structure_and_nothing_else():
    assert (local_thickness(np.zeros((5, 5), bool), 1.0) == 0).all()
    assert np.isinf(local_thickness(np.ones((5, 5), bool), 1.0)).all()


@pytest.mark.parametrize(
    ("image", "spacing", "message"),
    [
        (np.zeros((3, 3)), 1.0, "image must be bool of two or three dimensions; received"),
        (np.zeros(3, bool), 1.0, "image must be bool of two or three dimensions; received"),
        (np.zeros((3, 3), bool), 0.0, "spacing must be a number of m above 0; received 0"),
    ],
)
def test_wrong_images_are_refused(image, spacing, message):
    with pytest.raises(InputError, match=message):
        local_thickness(image, spacing)
