"""The figure of contacts: bars are fractions of grains, and the rose shows the directions."""

import numpy as np
import pytest

from tisim.errors import InputError
from tisim.plotting.contacts import ROSE_SECTORS, fabric, planar_density


def pairs_along(angles):
    """Two grains for each angle (rad) in the x-z plane, at unit distance."""
    first = np.stack([3.0 * np.arange(len(angles)), np.zeros(len(angles)), np.zeros(len(angles))], axis=1)
    second = first + np.stack([np.cos(angles), np.zeros(len(angles)), np.sin(angles)], axis=1)
    number = np.arange(len(angles))
    return np.concatenate([first, second]), np.stack([number, number + len(angles)], axis=1)


def test_bars_are_fractions_of_grains():
    """Three grains in a row and one without contacts."""
    position = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5]])
    bars, _ = fabric(position, np.array([[0, 1], [1, 2]])).axes
    assert [bar.get_height() for bar in bars.patches] == pytest.approx([1 / 4, 2 / 4, 1 / 4])


def test_the_rose_shows_the_distribution_of_directions(rng):
    """Angles are drawn from 1 + cos(2 theta - 0.6) by rejection; contacts count in both directions.

    Each bar has an error of 0.04.
    """
    angles = rng.uniform(-np.pi, np.pi, 60_000)
    angles = angles[rng.uniform(0, 2, len(angles)) < 1 + np.cos(2 * angles - 0.6)]
    _, rose = fabric(*pairs_along(angles), plane=(0, 2)).axes
    bars = np.array([bar.get_height() for bar in rose.patches])
    theta = -np.pi + 2 * np.pi / ROSE_SECTORS * (np.arange(ROSE_SECTORS) + 0.5)
    np.testing.assert_allclose(bars, 1 + np.cos(2 * theta - 0.6), atol=0.15)
    (line,) = rose.get_lines()
    np.testing.assert_allclose(line.get_ydata(), 1 + np.cos(2 * line.get_xdata() - 0.6), atol=0.05)
    assert bars.mean() == pytest.approx(1)
    assert [text.get_text() for text in rose.get_xticklabels()] == ["x", "z", "-x", "-z"]


def test_contacts_count_by_their_projection_onto_the_plane():
    """Two perpendicular contacts lie in the plane; the third is perpendicular to it and does not count."""
    position = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    _, rose = fabric(position, np.array([[0, 1], [0, 2], [0, 3]])).axes
    np.testing.assert_allclose(rose.get_lines()[0].get_ydata(), 1.0)


def test_density_of_one_direction():
    """The two-term density is 3 along the direction and -1 across."""
    along = np.outer([0.0, 1, 0], [0.0, 1, 0])
    np.testing.assert_allclose(planar_density(along, (0, 1), np.array([0, np.pi / 2])), [-1, 3])


def test_directions_point_to_the_nearest_image():
    """Two grains in contact along x across a face of a box of 10; the contact does not cross the box."""
    position = np.array([[0.2, 0.0, 0.0], [9.9, 0.2, 0.0]])
    _, rose = fabric(position, np.array([[0, 1]]), (10.0, 10.0, 10.0)).axes
    bars = np.array([bar.get_height() for bar in rose.patches])
    theta = -np.pi + 2 * np.pi / ROSE_SECTORS * (np.arange(ROSE_SECTORS) + 0.5)
    pointing = np.arctan2(0.2, -0.3)
    assert abs(theta[bars > 0] % np.pi - pointing % np.pi).max() < np.pi / ROSE_SECTORS


@pytest.mark.parametrize(("pairs", "plane"), [([], (0, 1)), ([[0, 1]], (0, 0)), ([[0, 1]], (0, 3))])
def test_nothing_to_draw_is_refused(pairs, plane):
    with pytest.raises(InputError, match="must be"):
        fabric(np.eye(3), np.reshape(pairs, (-1, 2)).astype(int), plane=plane)
