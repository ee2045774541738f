"""Pictures of solids against closed forms: silhouettes, surfaces, cuts, hidden parts, light and shade."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from tests.rendering.scenes import CAMERA, FRAME, SHAPES, body, raster
from tisim.rendering import z_buffer
from tisim.rendering.camera import Camera, ClipPlane, Raster, Window
from tisim.rendering.render import BEHIND_GLASS, GLASS, render
from tisim.rendering.shading import AMBIENT, occlusion
from tisim.rendering.solids import DrawnCylinders, DrawnRods, DrawnSpheres, Solids
from tisim.rendering.superquadrics import DrawnSuperquadrics
from tisim.rendering.surfaces import DrawnLines, DrawnTriangles
from tisim.rendering.z_buffer import entry, layer

TURN = Rotation.from_rotvec([0.4, -1.1, 0.7])
RED, GREEN, BLUE = np.eye(3)
TOWARDS = CAMERA.axes[:, 2]


def spheres(centre, radius, colour=RED) -> DrawnSpheres:
    centre = np.asarray(centre, float).reshape(-1, 3)
    radius = np.broadcast_to(np.asarray(radius, float), len(centre))
    return DrawnSpheres(centre=centre, radius=radius, colour=np.broadcast_to(colour, (len(centre), 3)))


def cylinder(turn=TURN, half=0.6, radius=0.3) -> DrawnCylinders:
    axis = turn.as_matrix()[:, 2]
    return DrawnCylinders(
        centre=np.zeros((1, 3)), colour=RED[None], axis=axis[None], half=np.array([half]),
        radius=np.array([radius]),
    )  # fmt: skip


def area(picture, window=FRAME) -> float:
    """Area that is covered, m^2."""
    return float(picture.rgba[..., 3].mean()) * window.width * window.height


def shadow(name: str) -> float:
    """Area of the silhouette of a turned shape, m^2."""
    shape, seen = SHAPES[name], TURN.inv().apply(TOWARDS)
    if name in ("rod", "needle"):
        half, radius = shape.rod()
        return 2 * radius * 2 * half * np.sqrt(1 - seen[2] ** 2) + np.pi * radius**2
    if name in ("sphere", "ellipsoid"):
        a, b, c = shape.half_extents()
        return np.pi * np.linalg.norm(seen * [b * c, a * c, a * b])
    # Farthest points along all directions across the line of sight.
    angle = np.linspace(0, 2 * np.pi, 4000)
    ways = np.cos(angle)[:, None] * CAMERA.axes[:, 0] + np.sin(angle)[:, None] * CAMERA.axes[:, 1]
    points = TURN.apply(shape.support(TURN.inv().apply(ways)))
    return ConvexHull(points @ CAMERA.axes[:, :2]).volume


@pytest.mark.parametrize("name", SHAPES)
def test_silhouettes_have_their_area(name):
    # The needle is 9 pixels wide.
    assert area(render(raster(), body(name, TURN))) == pytest.approx(shadow(name), rel=4e-3)


def test_the_silhouette_of_a_cylinder_has_its_area():
    for turn in (TURN, Rotation.align_vectors(TOWARDS[None], [[0.0, 0.0, 1.0]])[0]):
        slope = turn.as_matrix()[:, 2] @ TOWARDS
        expected = 2 * 0.3 * 2 * 0.6 * np.sqrt(max(0, 1 - slope**2)) + np.pi * 0.3**2 * abs(slope)
        assert area(render(raster(), [cylinder(turn)])) == pytest.approx(expected, rel=4e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_rays_enter_and_leave_at_the_surface(name, rng):
    """Entry points are on the surface, nothing of the body is nearer, and the normal is of the point that is
    farthest along it."""
    shape, (group,) = SHAPES[name], body(name, TURN)
    pixels = raster(1000)
    seen = group.seen_on(pixels)
    x, y = rng.uniform(0, 1000, (2, 20_000))
    k = np.zeros(len(x), int)
    top, low = seen.top(k, x, y), seen.bottom(k, x, y)
    hit = top > -np.inf
    assert 0.5 * shadow(name) < hit.mean() * FRAME.width**2 < 1.5 * shadow(name)
    np.testing.assert_array_equal(np.isinf(low), ~hit)

    def own(z):
        """Points in the frame of the body, m."""
        points = np.stack([x[hit], y[hit], z], axis=1) / pixels.scale + [FRAME.left, FRAME.bottom, 0]
        return TURN.inv().apply(points @ CAMERA.axes.T)

    off = 1e-3 * pixels.scale
    assert not shape.contains(own(top[hit] + off)).any()
    assert not shape.contains(own(low[hit] - off)).any()
    inside = top[hit] - low[hit] > 2 * off
    assert inside.mean() > 0.9
    assert shape.contains(own(np.where(inside, top[hit] - off, (top[hit] + low[hit]) / 2)))[inside].all()
    normal = seen.normal(k[hit], np.stack([x[hit], y[hit], top[hit]], axis=1))
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-9)
    assert (normal[:, 2] > -1e-3).all()
    outward, place = TURN.inv().apply(normal @ CAMERA.axes.T), own(top[hit])
    # The distance to the tangent plane of the farthest point along the normal.
    beyond = ((shape.support(outward) - place) * outward).sum(axis=1)
    np.testing.assert_allclose(beyond, 0, atol=2e-4)


def test_the_ends_of_a_cylinder_are_flat(rng):
    group = cylinder().seen_on(raster(1000))
    x, y = rng.uniform(0, 1000, (2, 20_000))
    k = np.zeros(len(x), int)
    z = group.top(k, x, y)
    hit = np.isfinite(z)
    out = np.stack([x, y, z], axis=1)[hit] - group.centre
    along = out @ group.axis[0]
    rho = np.linalg.norm(out - along[:, None] * group.axis[0], axis=1)
    flat = np.isclose(np.abs(along), group.half[0], rtol=1e-9)
    assert 0 < flat.mean() < 1
    np.testing.assert_allclose(rho[~flat], group.radius[0], rtol=1e-9)
    assert (rho[flat] <= group.radius[0] * (1 + 1e-9)).all()
    normal = group.normal(k[hit], np.stack([x, y, z], axis=1)[hit])
    np.testing.assert_allclose(np.abs(normal[flat] @ group.axis[0]), 1)
    np.testing.assert_allclose(normal[~flat] @ group.axis[0], 0, atol=1e-9)


def crowd(rng) -> list[Solids]:
    """Solids of all kinds, many of them hidden."""
    n = 150
    place, colour = rng.uniform(-1, 1, (6, n, 3)), rng.random((6, n, 3))
    turns = Rotation.random(n, rng=rng).as_matrix()
    size = rng.uniform(0.02, 0.15, n)
    corners = place[4][:, None] + 0.2 * rng.normal(size=(n, 3, 3))
    return [
        DrawnSpheres(centre=place[0], colour=colour[0], radius=size),
        DrawnRods(centre=place[1], colour=colour[1], axis=turns[:, :, 0], half=2 * size, radius=size / 4),
        DrawnCylinders(centre=place[2], colour=colour[2], axis=turns[:, :, 1], half=size, radius=size / 2),
        DrawnSuperquadrics(
            centre=place[3], colour=colour[3], turn=turns, semi_axes=size[:, None] * [1.0, 0.5, 0.7],
            exponents=np.tile([2.0, 4.0, 8.0], (n, 1)),
        ),
        DrawnTriangles.of(corners, BLUE),
        DrawnLines.of(place[5].reshape(-1, 2, 3), GREEN, 3.0),
    ]  # fmt: skip


open_ = z_buffer._Buffer.open


def rays(pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays through the middles of all pixels."""
    y, x = np.mgrid[:pixels, :pixels].reshape(2, -1) + 0.5
    return x, y


@pytest.mark.parametrize(
    "clip", [(), (ClipPlane((1, 0.3, 0), 0.4), ClipPlane((0, 0, -1), 0.6))], ids=["whole", "cut"]
)
def test_each_pixel_shows_the_nearest_solid(rng, clip, monkeypatch):
    """As one ray through each pixel and each solid finds it, also with planes that cut. Many solids are
    skipped, because they are hidden by those before."""
    monkeypatch.setattr(z_buffer, "PIXELS_AT_ONCE", 500)
    drawn = []
    monkeypatch.setattr(z_buffer._Buffer, "open", lambda *these: drawn.append(open_(*these)) or drawn[-1])
    pixels = raster(120)
    groups = [group.seen_on(pixels) for group in crowd(rng)]
    planes, (x, y) = [plane.on(pixels) for plane in clip], rays(120)
    depths = [
        entry(group, np.full(x.size, k), x, y, planes)[0] for group in groups for k in range(len(group))
    ]
    found = layer(groups, 120, 120, planes).solid.ravel()
    nearest = np.max(depths, axis=0)
    np.testing.assert_array_equal(found == -1, np.isneginf(nearest))
    filled = np.flatnonzero(found >= 0)
    # Solids that overlap have the same depth in a cut.
    np.testing.assert_allclose(np.array(depths)[found[filled], filled], nearest[filled], atol=1e-4)
    assert len(np.unique(found)) > 150
    assert (~np.concatenate(drawn)).sum() > 20


def test_the_farthest_surface_is_found_as_well(rng):
    pixels, (x, y) = raster(120), rays(120)
    group = DrawnTriangles.of(rng.uniform(-1, 1, (60, 3, 3)), BLUE).seen_on(pixels)
    depth = np.array([group.bottom(np.full(x.size, k), x, y) for k in range(len(group))])
    expected = np.where(np.isinf(depth).all(axis=0), -1, depth.argmin(axis=0))
    found = layer([group], 120, 120, farthest=True).solid.ravel()
    assert (found != expected).mean() < 2e-4


def test_the_order_of_solids_does_not_matter():
    near, far = spheres(0.5 * TOWARDS, 0.3, GREEN), spheres(-0.5 * TOWARDS, 0.6, RED)
    pictures = [render(raster(), groups).rgba for groups in ([near, far], [far, near])]
    np.testing.assert_array_equal(*pictures)
    middle, beside = pictures[0][200, 200], pictures[0][200, 200 + int(0.45 / 2.4 * 400)]
    assert middle[1] > middle[0]
    assert beside[0] > beside[1]


def test_spheres_that_overlap_meet_in_a_plane():
    right = CAMERA.axes[:, 0]
    pair = [spheres(0.25 * right, 0.5, RED), spheres(-0.25 * right, 0.5, GREEN)]
    rgba = render(raster(), pair).rgba
    red, drawn = rgba[..., 0] > rgba[..., 1], rgba[..., 3] == 1
    assert red[:, 201:][drawn[:, 201:]].all()
    assert not red[:, :199][drawn[:, :199]].any()


@pytest.mark.parametrize("height", [-0.4, 0.0, 0.3])
def test_a_cut_sphere_has_the_volume_of_its_cap(height):
    """The thickness is the sum of the depths of two pictures from opposite sides."""
    cut = ClipPlane((0.0, 0.6, 0.8), height)
    thickness = 0
    for camera, order in ((CAMERA, 1), (Camera(CAMERA.azimuth + 180, -CAMERA.elevation), -1)):
        picture = render(raster(800, camera), [spheres((0, 0, 0), 1.0)], clip=[cut])
        thickness = thickness + picture.depth[:, ::order]
    found = thickness[np.isfinite(thickness)].sum() / raster(800).scale ** 3
    high = 1 + height
    assert found == pytest.approx(np.pi * high**2 * (3 - high) / 3, rel=1e-2)


def test_a_cut_along_the_line_of_sight_leaves_half_a_sphere():
    picture = render(raster(), [spheres((0, 0, 0), 1.0)], clip=[ClipPlane(tuple(CAMERA.axes[:, 0]), 0.0)])
    assert area(picture) == pytest.approx(np.pi / 2, rel=4e-3)
    assert picture.rgba[:, 202:, 3].max() == 0


def test_a_cut_towards_the_viewer_is_flat_and_evenly_bright():
    picture = render(
        raster(), [spheres((0, 0, 0), 1.0, (0.5, 0.5, 0.5))], clip=[ClipPlane(tuple(TOWARDS), 0.2)]
    )
    assert area(picture) == pytest.approx(np.pi, rel=4e-3)
    middle = picture.rgba[120:280, 120:280]
    np.testing.assert_allclose(picture.depth[120:280, 120:280], 0.2 * raster().scale, rtol=1e-5)
    assert np.ptp(middle[..., 0]) < 1e-6
    assert middle[0, 0, 0] > 0.4


def test_walls_before_solids_are_transparent_and_walls_behind_them_are_not():
    right, up = CAMERA.axes[:, 0], CAMERA.axes[:, 1]
    square = np.array([-right - up, right - up, right + up, -right + up])
    wall = np.array([square[[0, 1, 2]], square[[0, 2, 3]]])
    grain = spheres((0, 0, 0), 0.4, RED)
    alone = render(raster(), [grain]).rgba[200, 200]
    for place, transparent in ((0.8, True), (-0.8, False)):
        walls = DrawnTriangles.of(wall + place * TOWARDS, np.ones(3))
        picture = render(raster(), [grain], [walls])
        assert area(picture) == pytest.approx(4.0, rel=4e-3)
        white = picture.rgba[200, 60, :3]
        assert white.min() > 0.7
        expected = alone[:3] + GLASS * (white - alone[:3]) if transparent else alone[:3]
        np.testing.assert_allclose(picture.rgba[200, 200, :3], expected, atol=0.03)


def test_lines_are_hidden_by_solids_only():
    right = CAMERA.axes[:, 0]
    ends = np.array([[-right, right]])
    grain = spheres((0, 0, 0), 0.4, RED)
    for place, shown in ((0.9, True), (-0.9, False)):
        lines = DrawnLines.of(ends + place * TOWARDS, BLUE, 6.0)
        rgba = render(raster(), [grain], edges=[lines]).rgba
        np.testing.assert_allclose(rgba[200, 50], [0, 0, 1, 1], atol=1e-6)
        assert (rgba[200, 200, 2] > BEHIND_GLASS - 0.05) == shown
    assert area(render(raster(), [], edges=[lines])) == pytest.approx(2 * 3 / 400 * 2.4, rel=0.05)


def test_the_side_towards_the_light_is_bright():
    rgba = render(raster(), [spheres((0, 0, 0), 1.0, (0.5, 0.5, 0.5))]).rgba
    upper_left, lower_right = rgba[300, 120, 0], rgba[90, 290, 0]
    assert upper_left > 1.5 * lower_right
    assert lower_right == pytest.approx(AMBIENT * (0.08 + 0.92 * 0.5), rel=0.1)


def test_the_shade_of_narrow_places():
    """An inclined plane is bright, a groove and the foot of a step are dark, and surfaces far apart cast no
    shade."""
    y, x = np.mgrid[:100, :100].astype(float)
    np.testing.assert_allclose(occlusion(0.7 * x - 0.3 * y, 8.0)[30:70, 30:70], 1, atol=1e-5)
    groove = occlusion(np.abs(x - 50), 8.0)[50]
    assert groove[50] < 0.6 < groove[20]
    step = occlusion(np.where(x < 50, 10.0, 0.0), 8.0)[50]
    assert step[51] < 0.85 < step[48]
    assert step[48] > 0.95
    cliff = occlusion(np.where(x < 50, 1e4, 0.0), 8.0)[50]
    assert cliff.min() > 0.99
    alone = occlusion(np.where((x - 50) ** 2 + (y - 50) ** 2 < 400, 0.0, -np.inf), 8.0)
    np.testing.assert_allclose(alone[50, 50], 1, atol=1e-5)


def test_what_is_not_finite_or_has_no_size_is_left_out():
    good = render(raster(), [spheres((0, 0, 0), 0.4)]).rgba
    bad = [(np.nan, 0, 0), (0, np.inf, 0), (0, 0, 0), (0.1, 0, 0), (0, 0, 0)]
    sizes = [0.4, 0.4, np.nan, 0.0, 0.4]
    np.testing.assert_array_equal(render(raster(), [spheres(bad, sizes)]).rgba, good)
    turns = np.full((1, 3, 3), np.nan)
    blurred = DrawnSuperquadrics(
        centre=np.zeros((1, 3)), colour=RED[None], turn=turns, semi_axes=np.ones((1, 3)),
        exponents=np.full((1, 3), 2.0),
    )  # fmt: skip
    assert render(raster(), [blurred]).rgba.max() == 0


def test_nothing_gives_an_empty_picture():
    for groups in ([], [spheres(np.empty((0, 3)), np.empty(0))], [spheres((9, 9, 9), 0.1)]):
        picture = render(raster(50), groups)
        assert picture.rgba.shape == (50, 50, 4)
        assert picture.rgba.max() == 0
        assert np.isneginf(picture.depth).all()


def test_sizes_that_differ_by_four_decades_are_drawn():
    """Tiny spheres on a large one are visible dots."""
    tops = CAMERA.axes[:, 2] + 0.3 * np.array([-1, 0, 1])[:, None] * CAMERA.axes[:, 0]
    tops *= 1.0001 / np.linalg.norm(tops, axis=1)[:, None]
    rgba = render(raster(), [spheres((0, 0, 0), 1.0, RED), spheres(tops, 1e-4, GREEN)]).rgba
    assert area(render(raster(), [spheres((0, 0, 0), 1.0)])) == pytest.approx(np.pi, rel=4e-3)
    green = rgba[..., 1] > rgba[..., 0]
    assert 3 <= green.sum() <= 12
    # They stand at 0.3/1.044 m from the middle.
    columns = np.flatnonzero(green.any(axis=0))
    for place in (-0.2874, 0.0, 0.2874):
        assert np.abs(columns - (200 + place * raster().scale)).min() < 2


def test_a_solid_far_behind_does_not_blur_depths():
    near = [spheres(0.01 * TOWARDS, 0.4, GREEN), spheres(0 * TOWARDS, 0.4, RED)]
    rgba = render(raster(), [*near, spheres(-1e13 * TOWARDS, 0.9, BLUE)]).rgba
    middle = rgba[160:240, 160:240]
    assert (middle[..., 1] > middle[..., 0]).all()
    assert rgba[200, 340, 2] > 0.3


def test_a_sphere_around_the_whole_picture_fills_it():
    picture = render(raster(), [spheres(-1e4 * TOWARDS, 1e4)])
    assert (picture.rgba[..., 3] == 1).all()


def test_pictures_need_not_be_square():
    window = Window(-2.0, -1.0, 4.0, 2.0)
    picture = render(Raster(CAMERA, window, 300, 150), [spheres((0, 0, 0), 0.8)])
    assert picture.rgba.shape == (150, 300, 4)
    assert area(picture, window) == pytest.approx(np.pi * 0.64, rel=5e-3)


def test_the_camera_has_right_handed_axes_and_an_upright_z(rng):
    for azimuth, elevation in rng.uniform([-360, -90], [360, 90], (20, 2)):
        axes = Camera(azimuth, elevation).axes
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1)
        assert abs(axes[2, 0]) < 1e-12
        assert axes[2, 1] >= 0
    np.testing.assert_allclose(Camera(0, 90).project([0, 0, 1]), [0, 0, 1], atol=1e-12)
