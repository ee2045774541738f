"""What pictures show: the window, the box, magnets and fibres, and grains that leave."""

from __future__ import annotations

import numpy as np
import pytest

from tests.effects.contact.grains import USUAL as CONTACT
from tests.scenes import scene
from tisim import Box, Material, geometry
from tisim.effects import Granular, Walls
from tisim.plotting.cloud import caption, panel, start_and_end
from tisim.plotting.look import Look
from tisim.plotting.scenery import NO_SCENERY, box_scenery, remaining, scenery, window
from tisim.plotting.style import empty
from tisim.rendering.camera import Window
from tisim.sources import Cylinder, MagneticCylinders, MagneticSpheres, PoreFlow, Sphere

FRONT = Look.of(view="-90,0")
"""Seen along y: x is right, z is up."""


def state(place, radius=0.1):
    place = np.asarray(place, float).reshape(-1, 3)
    return {"position": place, "radius": np.broadcast_to(radius, len(place)).astype(float)}


def test_a_window_contains_all_grains_of_the_start_with_a_border():
    grains = state([(-1, 5, 0), (2, -7, 1), (0, 0, -3)])
    left, bottom, width, height = window([grains], look=FRONT)
    assert width == height == pytest.approx(4.2 * 1.06)
    assert (left + width / 2, bottom + height / 2) == pytest.approx((0.5, -1.0))
    assert window([grains], look=FRONT, ratio=2.0).width == pytest.approx(2 * 4.2 * 1.06)


@pytest.mark.parametrize("way", [(1e3, 0, 0), (0, 0, -1e9), (50, 3, 50)])
@pytest.mark.parametrize("number", [10, 300])
def test_grains_that_leave_do_not_make_the_others_smaller(rng, number, way):
    grains = rng.normal(size=(number, 3))
    gone = np.concatenate([grains, np.array(way)[None]])
    start = state(grains)
    assert window([start, state(gone)], look=FRONT) == window([start, start], look=FRONT)
    assert remaining(gone, np.full(number + 1, 0.1)).tolist() == [True] * number + [False]


def test_a_cloud_that_expands_stays_in_the_window(rng):
    grains = rng.normal(size=(500, 3))
    part = window([state(grains), state(20 * grains)], look=FRONT)
    assert (20 * grains[:, [0, 2]] >= [part.left, part.bottom]).all()
    assert (20 * grains[:, [0, 2]] <= [part.left + part.width, part.bottom + part.height]).all()


def test_with_walls_or_a_box_even_all_grains_may_leave(rng):
    grains = state(rng.uniform(-1, 1, (50, 3)))
    fallen = state(grains["position"] - [0, 0, 1e4])
    box = box_scenery(np.full(3, -1.5), np.full(3, 1.5))
    assert window([grains, fallen], [box], FRONT).height <= 2 * 3 * 1.06
    assert window([grains, fallen], [NO_SCENERY], FRONT).height > 1e4


def test_a_crop_is_a_part_of_the_window():
    grains = state([(0, 0, 0)], 1.0)
    whole = window([grains], look=FRONT)
    part = window([grains], look=Look.of(view="-90,0", crop="0.5,1,0,0.25"))
    assert part == pytest.approx(
        (whole.left + whole.width / 2, whole.bottom, whole.width / 2, whole.height / 4)
    )


def test_positions_that_are_not_numbers_are_counted_and_do_not_matter():
    good, bad = state([(0, 0, 0), (1, 0, 0)]), state([(0, 0, 0), (1, 0, 0), (np.nan, 0, 0), (0, np.inf, 0)])
    assert window([bad], look=FRONT) == window([good], look=FRONT)
    made = scene([(0, 0, 0)], [(0, 0, 0)])
    assert caption(bad, 0.0, made).startswith("t = 0 s: 4 grains, 2 without a position, mean radius 100 mm")
    figures = [start_and_end((one, one), (0.0, 1.0), made) for one in (good, bad)]
    images = [figure.axes[0].images[0].get_array() for figure in figures]
    np.testing.assert_array_equal(*images)


@pytest.mark.parametrize("place", [np.empty((0, 3)), [(3.0, 4.0, 5.0)], np.full((2, 3), np.nan)])
def test_no_grain_or_one_is_drawn(place):
    made = scene([(0, 0, 0)], [(0, 0, 0)])
    figure = start_and_end((state(place), state(place)), (0.0, 1.0), made)
    figure.draw_without_rendering()
    covered = figure.axes[0].images[0].get_array()[..., 3].mean()
    assert covered == (pytest.approx(np.pi / 4 / 1.06**2, rel=0.01) if len(place) == 1 else 0)


def test_nothing_at_all_has_a_window_of_a_metre():
    assert window([state(np.empty((0, 3)))]) == Window(-0.5, -0.5, 1.0, 1.0)


def test_the_box_has_twelve_edges_and_is_in_the_window():
    made = scene([(0, 0, 0)], [(0, 0, 0)], domain=Box(low=(-1, -2, -3), high=(1, 2, 3)))
    around = scenery(made, [made.start()], 0.0)
    (edges,) = around.edges
    lengths = np.linalg.norm(edges.ends[:, 1] - edges.ends[:, 0], axis=1)
    assert sorted(lengths) == pytest.approx([2] * 4 + [4] * 4 + [6] * 4)
    assert window([made.start()], [around], FRONT).height == pytest.approx(6 * 1.06)


def test_magnets_and_fibres_are_bodies_each_once():
    fibre = Cylinder(centre=(0, 0, 1e-3), axis=(1, 0, 0), radius=1e-4, length=2e-3, magnetisation=(1e5, 0, 0))
    ball = Sphere(centre=(0, 1e-3, 0), radius=3e-4, magnetisation=(1e5, 0, 0))
    flow = PoreFlow(
        low=(-2e-3,) * 3, high=(2e-3,) * 3, pressure_gradient=1.0, viscosity=1e-3, cylinders=(fibre,),
        spheres=(Sphere(centre=(0, 0, -1e-3), radius=2e-4),), cells=(8, 8, 8),
    )  # fmt: skip
    effects = (MagneticCylinders(cylinders=(fibre,)), MagneticSpheres(spheres=(ball,)), flow)
    made = scene([(0, 0, 0)], [(0, 0, 0)], effects, radius=1e-5)
    around = scenery(made, [made.start()], 0.0)
    cylinders, spheres = around.solids
    np.testing.assert_allclose(cylinders.axis, [[1, 0, 0]])
    assert (cylinders.half.tolist(), cylinders.radius.tolist()) == ([1e-3], [1e-4])
    assert sorted(spheres.radius) == [2e-4, 3e-4]
    # They are in the window as a whole: the fibre from -1 to 1 mm, and from 1.1 mm down to -1.2 mm.
    part = window([made.start()], [around], FRONT)
    assert (part.width, part.height) == pytest.approx((2.3e-3 * 1.06, 2.3e-3 * 1.06), rel=1e-2)


def test_a_steel_grain_and_a_rubber_grain_differ():
    steel, rubber = Material(**CONTACT), Material(**CONTACT)
    floor = Walls(planes=[geometry.Plane(point=(0, 0, -1))])
    made = scene(
        [(0, 0, 0), (0.3, 0, 0)], np.zeros((2, 3)), (Granular(), floor), 0.1,
        materials={"steel": steel, "rubber": rubber}, material=["steel", "rubber"],
    )  # fmt: skip
    figure = start_and_end((made.start(), made.start()), (0.0, 1.0), made, look=FRONT)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["steel", "rubber"]
    image = figure.axes[0].images[0].get_array()
    colours = [np.asarray(patch.get_facecolor()[:3]) for patch in legend.get_patches()]
    middle = image.shape[0] // 2
    left, right = image[middle, int(0.22 * image.shape[1]), :3], image[middle, int(0.78 * image.shape[1]), :3]
    for seen, own, other in ((left, *colours), (right, *colours[::-1])):
        seen, own, other = (one / np.linalg.norm(one) for one in (seen, own, other))
        assert np.linalg.norm(seen - own) < 0.5 * np.linalg.norm(seen - other)


@pytest.mark.parametrize(
    ("width", "label"), [(3.9999999999999996e-05, "10 µm"), (3.9e-5, "5 µm"), (4.0, "1 m"), (81.0, "20 m")]
)
def test_the_scale_bar_is_a_round_length_of_at_most_a_quarter(width, label):
    """The first width is 40 µm up to rounding."""
    axis = empty(2, 2).subplots()
    nothing = {"position": np.zeros((0, 3)), "radius": np.zeros(0)}
    panel(axis, nothing, Window(-width / 2, 0.0, width, width), pixels=10)
    assert [text.get_text() for text in axis.texts] == [label]
