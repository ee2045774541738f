"""The figures of directions of rods, and of neighbours and pores."""

import numpy as np
import pytest

from tisim import InputError
from tisim.analysis import (
    PackedBodies,
    direction_histogram,
    packing_diffusion,
    pore_image,
    pore_sizes,
    surface_correlation,
)
from tisim.plotting.packings import directions, structure
from tisim.shapes import SphereShape, SpherocylinderShape


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


def test_neighbours_and_pores_of_two_packings_are_drawn_side_by_side(rng):
    """Spheres and rods at random places in a small box, which may overlap."""
    shapes = {"spheres": SphereShape(diameter=2.0), "rods": SpherocylinderShape(length=2.0, diameter=2.0)}
    made = {
        name: PackedBodies.of(shape, rng.uniform(0, 12, (40, 3)), low=(0, 0, 0), high=(12, 12, 12))
        for name, shape in shapes.items()
    }
    figure = structure(made, spacing=0.25, reach=1.0)
    near, pores, paths = figure.axes
    for one, drawn, line, points in zip(made.values(), near.patches, pores.lines, paths.lines, strict=False):
        values, edges, _ = drawn.get_data()
        np.testing.assert_allclose(values, surface_correlation(one, 2.0 * edges))
        assert edges[-1] == 1.0
        diameter, part = line.get_data()
        sizes = pore_sizes(one, 0.5)
        np.testing.assert_allclose(diameter, sizes.diameter / 2.0)
        assert part[-1] == pytest.approx(1.0)
        assert diameter[np.searchsorted(part, 0.5)] == pytest.approx(sizes.quantile(0.5) / 2.0)
        along = [packing_diffusion(one, 0.5, axis) for axis in range(3)]
        np.testing.assert_allclose(points.get_xdata(), pore_image(one, 0.5).mean())
        np.testing.assert_allclose(points.get_ydata(), [each.tortuosity for each in along])
    assert [text.get_text() for text in pores.get_legend().texts] == ["spheres", "rods"]
    x, y = paths.lines[-1].get_data()
    np.testing.assert_allclose(y * y * x, 1.0)
    for given, message in (
        ({}, "packings must be at least one"),
        (made, "reach must be above 0; received 0"),
    ):
        with pytest.raises(InputError, match=message):
            structure(given, reach=0.0)
