"""Profiles, radial distributions and slopes with known answers."""

import numpy as np
import pytest

from tisim import InputError
from tisim.analysis import (
    granular_temperature,
    layer_means,
    radial_distribution,
    slope_angles,
    surface_profile,
)


def test_layer_means_and_empty_layers():
    position = np.array([[0, 0, 0.1], [0, 0, 0.9], [0, 0, 2.5], [0, 0, 9.0]])
    edges = np.arange(4.0)
    np.testing.assert_array_equal(layer_means(position, [1.0, 2.0, 5.0, 7.0], edges), [1.5, np.nan, 5.0])
    vectors = layer_means(position, position, edges)
    np.testing.assert_array_equal(vectors[:, 2], [0.5, np.nan, 2.5])
    np.testing.assert_array_equal(
        layer_means(position, [1.0, 2.0, 5.0, 7.0], edges, axis=0), [3.75, *2 * [np.nan]]
    )


def test_granular_temperature_beside_a_mean_flow_and_its_shear(rng):
    """Means over many layers with few grains each are unbiased. Shear flow alone gives zero; two grains are
    too few."""
    position = rng.uniform(0, 400, (8000, 3))
    flow = np.column_stack([7 + 3 * position[:, 2], -position[:, 2], 0 * position[:, 2]])
    edges = np.linspace(0, 400, 1001)
    assert np.nanmax(granular_temperature(position, flow, edges)) < 1e-15 * np.abs(flow).max() ** 2
    found = granular_temperature(position, flow + rng.normal(size=(8000, 3)) * 0.5, edges)
    weights = np.maximum(np.histogram(position[:, 2], edges)[0] - 2, 0)
    mean = np.nansum(found * weights) / weights[np.isfinite(found)].sum()
    assert mean == pytest.approx(0.25, abs=4 * 0.25 * np.sqrt(2 / (3 * weights.sum())))
    assert np.isnan(granular_temperature(position[:2], flow[:2], edges)).all()


@pytest.mark.parametrize(
    "sides", [None, (9.0, 9.0, 9.0), (9.0, 0, 9.0), [[9.0, 0, 0], [3.0, 9.0, 0], [0, 0, 9.0]]]
)
def test_particles_at_random_have_a_radial_distribution_of_one(rng, sides):
    """In a box: periodic, open or sheared. Grains outside the box along an open axis are not counted."""
    position = rng.uniform(-1.0 if sides is None else 0.0, 9.0, (4000, 3))
    edges = np.array([0.0, 0.8, 1.4, 2.0])
    g = radial_distribution(position, edges, (0, 0, 0), (9, 9, 9), sides)
    np.testing.assert_allclose(g, 1.0, atol=0.05)


def test_the_radial_distribution_of_a_lattice_counts_its_neighbours():
    sites = np.stack(np.meshgrid(*3 * [np.arange(8.0)], indexing="ij"), -1).reshape(-1, 3)
    edges = np.array([0.0, 0.9, 1.1, 1.5, 1.8])
    shells = 4 / 3 * np.pi * np.diff(edges**3)
    g = radial_distribution(sites, edges, (0, 0, 0), (8, 8, 8), (8, 8, 8))
    np.testing.assert_allclose(g * shells * 511 / 512, [0, 6, 12, 8])
    g = radial_distribution(sites + 0.5, edges, (0, 0, 0), (8, 8, 8))
    np.testing.assert_allclose(g * shells * 511 / 512, [0, 6, 12, 8])


@pytest.mark.parametrize(
    ("edges", "sides", "text"),
    [
        ([0.0, 5.0], None, "edges must be at most half a side of the box"),
        ([1.0, 0.5], None, "edges must be rising distances"),
        ([0.0, 1.0], (3.0, 8.0, 8.0), "high - low must be the sides along which the box is periodic"),
        ([0.0, 3.9], None, "particles must be at least one that is farther than the last edge"),
    ],
)
def test_invalid_radial_distributions_are_refused(edges, sides, text):
    with pytest.raises(InputError, match=text):
        radial_distribution(np.ones((5, 3)), edges, (0, 0, 0), (8, 8, 8), sides)


def slope(rng, profile, length=0.1, depth=0.02, step=1.2e-3):
    """Grains of two sizes below a surface, in a box."""
    axes = [np.arange(0, side, step) for side in (depth, length, 0.08)]
    sites = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    sites = sites + rng.uniform(-0.5, 0.5, sites.shape) * step
    position = sites[sites[:, 2] < profile(sites[:, 1])]
    return position, rng.choice([0.5e-3, 0.7e-3], len(position))


@pytest.mark.parametrize("degrees", [20.0, 33.0])
@pytest.mark.parametrize("back", [False, True])
def test_the_angle_of_a_slope_in_a_box(rng, degrees, back):
    tan = np.tan(np.radians(degrees))
    height = 0.09 * tan
    position, radius = slope(rng, lambda y: height - tan * (0.1 - y if back else y))
    angles, breaks = slope_angles(*surface_profile(position, radius))
    assert np.degrees(angles) == pytest.approx([degrees], abs=1.0)
    assert len(breaks) == 0


@pytest.mark.parametrize("back", [False, True])
def test_a_slope_of_two_angles(rng, back):
    """A slope of 45 degrees above one of 25 degrees."""
    knee, foot = 0.03, np.tan(np.radians(25.0))

    def profile(y):
        y = 0.1 - y if back else y
        return foot * (0.1 - knee) - np.where(y < knee, y - knee, foot * (y - knee))

    angles, breaks = slope_angles(*surface_profile(*slope(rng, profile)), pieces=2, part=(0.05, 0.95))
    assert np.degrees(angles) == pytest.approx([45.0, 25.0], abs=2.0)
    assert breaks == pytest.approx([0.1 - knee if back else knee], abs=3e-3)


def test_a_flat_bed_has_no_slope(rng):
    place, height = surface_profile(*slope(rng, lambda y: 0.02 + 0 * y))
    with pytest.raises(InputError, match="slope must be at least 3 mean diameters wide"):
        slope_angles(place, height)
    with pytest.raises(InputError, match="pieces must be 1 or 2; received 3"):
        slope_angles(place, height, pieces=3)
