"""Grids of triangles: every triangle near a point is listed there, and lists are bounded."""

import time

import numpy as np
import pytest

from tisim.geometry import TriangulatedSurface, triangle_grid
from tisim.geometry.triangle_grid import TriangleGrid


def uneven(fine, long):
    """A sheet of a few long, tilted facets with a finely meshed bolt on it; (triangles, 3, 3), m."""
    t = np.linspace(0, 2 * np.pi, fine // 2 + 1)
    foot = np.column_stack([0.02 * np.cos(t), 0.02 * np.sin(t), 0 * t])
    top = foot + np.array([0, 0, 0.02])
    bolt = [np.stack([foot[:-1], foot[1:], top[1:]], 1), np.stack([foot[:-1], top[1:], top[:-1]], 1)]
    u = np.linspace(0, 1, long // 2 + 1)[:, None]
    low, high = (np.array(end) + u * [0.4, -0.4, 0.0] for end in ([-2.5, -2.5, 0.0], [2.5, 2.5, 2.5]))
    sheet = [np.stack([low[:-1], high[:-1], high[1:]], 1), np.stack([low[:-1], high[1:], low[1:]], 1)]
    return np.concatenate([*bolt, *sheet])


def slivers(number, thin=1e-5):
    """Triangles of a km by 10 um."""
    y = thin * np.arange(number)
    return np.stack([np.stack([x + 0 * y, y, z + 0 * y], 1) for x, z in ((0, 0), (1e3, 0), (1e3, thin))], 1)


@pytest.mark.parametrize(
    "corners", [uneven(2000, 40), uneven(4000, 200), slivers(5000)], ids=["sheet", "body", "slivers"]
)
def test_a_mesh_of_some_thousand_triangles_takes_seconds_and_few_entries(corners):
    """Earlier there were more than 1e8 entries."""
    began = time.perf_counter()
    grid = TriangleGrid.of(corners)
    assert time.perf_counter() - began < 60
    assert len(grid.members) <= triangle_grid.MOST_LISTED
    assert np.prod(grid.dims) <= triangle_grid.CELLS
    assert set(grid.members) == set(range(len(corners)))


def test_large_triangles_are_listed_in_every_cell_that_they_meet():
    """Points all over each triangle lie in cells that list it, and none of these cells is marked as clear."""
    corners = uneven(200, 20)
    grid, rng = TriangleGrid.of(corners), np.random.default_rng(0)
    assert (grid.first[-20:] < 0).all()
    assert (grid.first[:200] >= 0).all()
    shares = rng.dirichlet((1, 1, 1), 2000)
    for k in (0, 100, 200, 205, 219):
        places = shares @ corners[k]
        at = np.minimum(((places - grid.low) / grid.width).astype(int), grid.dims - 1)
        cells = (at[:, 0] * grid.dims[1] + at[:, 1]) * grid.dims[2] + at[:, 2]
        for cell in np.unique(cells):
            assert k in grid.members[grid.begin[cell] : grid.begin[cell + 1]]
            assert grid.clear[cell] == 0
    # A large triangle is listed in few of the cells of its bounding box.
    box = np.ptp(corners[200], axis=0) / grid.width
    assert (grid.members == 200).sum() < 0.2 * box.prod()


def test_a_start_beside_many_triangles_is_checked_in_a_second():
    """A loop over 10^5 triangles in Python took half a minute."""
    rng = np.random.default_rng(0)
    corners = rng.uniform(size=(100_000, 1, 3)) + 1e-2 * rng.normal(size=(100_000, 3, 3))
    surface = TriangulatedSurface(vertices=corners.reshape(-1, 3), faces=np.arange(300_000).reshape(-1, 3))
    began = time.perf_counter()
    far = surface.distances(np.array([[0.5, 0.5, 3.0], [-2.0, 0.5, 0.5]]))
    assert time.perf_counter() - began < 5
    nearest = np.linalg.norm(corners.reshape(-1, 3) - [0.5, 0.5, 3.0], axis=1).min()
    assert nearest - 0.05 < far[0] <= nearest
