"""Figures of measures show the measured values in the labelled units."""

import numpy as np
import pytest

from tests.scenes import scene
from tisim.analysis import bounding_ellipsoid, fit_bingham, fit_biviscous, fit_herschel_bulkley, labels
from tisim.effects import Tether
from tisim.plotting.clusters import clusters
from tisim.plotting.measures import chain_lengths, flow_curve, neighbours, profiles
from tisim.rendering.camera import USUAL_CAMERA

RATE = np.geomspace(1, 1000, 12)


def test_a_flow_curve_has_its_points_and_the_laws_with_their_numbers():
    stress = 4e3 + 2.0 * RATE
    fits = fit_bingham(RATE, stress), fit_herschel_bulkley(RATE, stress)
    (axis,) = flow_curve(RATE, stress, fits).axes
    line, power = (one for one in axis.get_lines() if len(one.get_xdata()) > 100)
    np.testing.assert_allclose(line.get_ydata(), 4e3 + 2.0 * line.get_xdata())
    np.testing.assert_allclose(power.get_ydata(), line.get_ydata(), rtol=1e-6)
    texts = [text.get_text() for text in axis.get_legend().get_texts()]
    assert texts[0].startswith("(4000 ±")
    assert "n = 1 ±" in texts[1]
    assert axis.get_ylabel() == "shear stress (kPa)"
    assert axis.get_xscale() == "log"
    creeping = fit_biviscous(RATE, np.minimum(500 * RATE, stress))
    (legend,) = flow_curve(RATE, stress, (creeping,)).axes[0].get_legend().get_texts()
    assert legend.get_text().startswith("(4000 ±")
    assert ",\nat most (500 ±" in legend.get_text()


@pytest.mark.parametrize(
    ("diameter", "label", "end"), [(None, "distance of centres (mm)", 3e-3), (1e-3, "over", 3)]
)
def test_neighbours_over_the_diameter_or_in_metres(diameter, label, end):
    (axis,) = neighbours(np.linspace(0, 3e-3, 7), np.ones(6), diameter).axes
    assert label in axis.get_xlabel()
    assert axis.get_xlim()[1] == pytest.approx(end)


def test_chain_lengths_are_fractions_of_particles():
    """Six single particles, two pairs and a chain of four."""
    cluster = np.repeat(np.arange(9), [1] * 6 + [2] * 2 + [4])
    (axis,) = chain_lengths(cluster).axes
    assert [bar.get_height() for bar in axis.patches] == pytest.approx([6 / 14, 4 / 14, 0, 4 / 14])
    assert axis.get_lines()[0].get_ydata() == pytest.approx([1, 8 / 14, 4 / 14, 4 / 14])


def test_profiles_have_no_prefix_before_a_power_of_a_unit():
    edges, values = np.linspace(0, 0.01, 5), np.full(4, 1e-4)
    panels = profiles(
        edges, {("speed", "m/s"): values, ("temperature", "m^2/s^2"): values, ("fraction", ""): values}
    )
    labels = [axis.get_xlabel() for axis in panels.axes]
    assert labels == ["speed (µm/s)", "temperature (m²/s²)", "fraction"]
    assert panels.axes[0].get_ylabel() == "height (mm)"
    np.testing.assert_allclose(panels.axes[0].get_lines()[0].get_ydata(), (edges[1:] + edges[:-1]) / 2)


def test_outlines_of_ellipsoid_and_hull_enclose_all_points(rng):
    """A point of the ellipsoid is within its outline and the farthest one on it; spheres and hull
    likewise."""
    position, radius = rng.normal(size=(40, 3)) * (3, 2, 1), np.full(40, 0.2)
    around = bounding_ellipsoid(position, radius)
    made = scene(position, 0 * position, (Tether(stiffness=(1.0, 1.0, 1.0)),), radius=radius)
    state = {"position": position, "radius": radius}
    figure = clusters(state, labels(40, np.array([[0, 1], [1, 2], [5, 9]])), made, around, hull=True)
    (axis,) = figure.axes
    named = {line.get_label(): line.get_xydata() for line in axis.get_lines()}
    u = rng.normal(size=(20000, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    for name, points in (
        ("bounding ellipsoid", around.centre + u * around.semi_axes @ around.axes),
        ("convex hull", (position[:, None] + 0.2 * u[None, :500]).reshape(-1, 3)),
    ):
        seen = USUAL_CAMERA.project(points)[:, :2]
        for angle in np.linspace(0, np.pi, 13):
            way = np.array([np.cos(angle), np.sin(angle)])
            assert (seen @ way).max() == pytest.approx((named[name] @ way).max(), abs=0.03)
    assert axis.get_title("left") == "5 of 40 in 2 clusters"
