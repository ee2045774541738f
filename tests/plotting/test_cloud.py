"""Pictures of particle clouds in a square that may not contain all of them."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from tisim.plotting.cloud import panel
from tisim.plotting.facets import PROJECTION


def image(position):
    """Picture of grains with a radius of 1 m in a square of 10 m about the centre."""
    axis = Figure().subplots()
    state = {"position": position, "radius": np.ones(len(position))}
    panel(axis, state, (-5.0, -5.0, 10.0), np.empty((0, 3)))
    return np.asarray(axis.images[0].get_array())


@pytest.mark.parametrize("way", [(-8, 0), (0, -8), (8, 0), (0, 8), (-8, -8), (-40, 3)])
def test_a_grain_beyond_the_square_is_not_seen(way):
    middle = image(np.zeros((1, 3)))
    assert middle[..., 3].max() == 1.0
    beyond = PROJECTION[:, :2] @ np.array(way, float)
    np.testing.assert_array_equal(image(np.array([[0.0, 0, 0], beyond])), middle)
