"""The figure of directions of rods."""

import numpy as np
import pytest

from tisim import InputError
from tisim.analysis import direction_histogram
from tisim.plotting.packings import directions


def test_directions_are_drawn_with_one_scale(rng):
    random = rng.normal(size=(500, 3))
    random /= np.linalg.norm(random, axis=1, keepdims=True)
    along_x = np.tile([1.0, 0.0, 0.0], (20, 1))
    shown = {"random": direction_histogram(random), "along x": direction_histogram(along_x, folded=False)}
    figure = directions(shown)
    *panels, bar = figure.axes
    meshes = [panel.collections[0] for panel in panels]
    for mesh, one in zip(meshes, shown.values(), strict=True):
        np.testing.assert_array_equal(mesh.get_array(), one.density)
        assert mesh.get_clim() == (0, 81)
    assert [panel.get_title(loc="left") for panel in panels] == ["(a) random", "(b) along x"]
    assert panels[0].get_xlim() == (0, 90)
    assert panels[1].get_xlim() == (-180, 180)
    assert "1: random" in bar.get_ylabel()


def test_nothing_to_draw_is_refused():
    with pytest.raises(InputError, match="histograms must be at least one; received 0"):
        directions({})
