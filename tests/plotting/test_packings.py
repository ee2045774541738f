"""The figures of directions of rods, of neighbours and pores, and of rattlers and bond order."""

from dataclasses import replace

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
from tisim.analysis.packings.packing_fractions import FractionProfile
from tisim.plotting.packings import CRYSTALS, directions, order, structure
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


LATTICES = {
    "fcc": ([(0, 0, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 0)], (1, 1, 1), 2**-0.5),
    "bcc": ([(0, 0, 0), (0.5, 0.5, 0.5)], (1, 1, 1), 0.75**0.5),
    "hcp": ([(0, 0, 0), (0.5, 0.5, 0), (0.5, 5 / 6, 0.5), (0, 1 / 3, 0.5)], (1, 3**0.5, (8 / 3) ** 0.5), 1.0),
}
"""Places of the bodies of a cell in its sides, the sides, and the distance of neighbours."""


def lattice(name, cells=3):
    """Spheres that touch their neighbours in a lattice."""
    basis, sides, near = LATTICES[name]
    corners = np.stack(np.meshgrid(*3 * [np.arange(cells)], indexing="ij"), -1).reshape(-1, 1, 3)
    high = cells * np.array(sides)
    # Voronoi cells of an exact lattice can have facets of no area.
    moved = 1e-6 * np.random.default_rng(2).normal(size=(len(basis) * cells**3, 3))
    places = ((corners + np.array(basis)).reshape(-1, 3) * sides + moved) % high
    return PackedBodies.of(SphereShape(diameter=near), places, low=(0, 0, 0), high=high)


def test_rattlers_and_bond_order_of_crystals_are_drawn(rng):
    """No sphere of a crystal is a rattler if gaps of 1e-4 D count, all spheres far apart are; crosses are at
    the bond order of the lattices; layers at a wall are drawn as given."""
    made = {name: lattice(name) for name in LATTICES}
    apart = PackedBodies.of(
        SphereShape(diameter=0.1), rng.uniform(0, 12, (40, 3)), low=(0, 0, 0), high=(12,) * 3
    )
    layers = FractionProfile(np.array([0.0, 0.5, 1.0]), np.array([0.7, 0.5]), np.zeros(2), np.ones(2))
    figure = order({**made, "gas": apart}, {"at a wall": layers})
    loose, bonds, walls = figure.axes
    for name, line, points in zip([*made, "gas"], loose.lines, bonds.lines, strict=False):
        gap, part = line.get_data()
        assert (part[gap > 1e-4] == (name == "gas")).all()
        if name in CRYSTALS:
            q4, q6 = points.get_data()
            np.testing.assert_allclose(np.column_stack([q4, q6]), [CRYSTALS[name]] * len(q4), atol=1e-3)
    assert [text.get_text() for text in loose.get_legend().texts] == [*made, "gas"]
    np.testing.assert_array_equal(walls.patches[0].get_data()[0], layers.fraction)
    assert len(order(made).axes) == 2
    for given, message in (
        ({}, "packings must be at least one"),
        ({"x": apart_from_walls(apart)}, "periodic"),
    ):
        with pytest.raises(InputError, match=message):
            order(given)


def apart_from_walls(packing):
    """The same bodies between walls."""
    return replace(packing, periodic=(False, True, True))
