"""Shapes: distances of points, against samples of their faces, in one kernel."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import tisim
from tisim import InputError, Scene, geometry
from tisim.backend import runtime
from tisim.backend.memory import collected
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.component import Component, option
from tisim.state.parameter_table import ParameterTable

POINTS = 300
LISTS = ("planes", "discs", "spheres", "cylinders", "cones", "boxes")
MESH = 6
"""The column of the triangles."""


class Shapes(Component):
    """Some shapes of each kind, as in walls."""

    planes: tuple[geometry.Plane, ...] = option("planes")
    discs: tuple[geometry.Disc, ...] = option("discs")
    spheres: tuple[geometry.SphericalSurface, ...] = option("spheres")
    cylinders: tuple[geometry.CylindricalSurface, ...] = option("cylinders")
    cones: tuple[geometry.ConicalSurface, ...] = option("cones")
    boxes: tuple[geometry.BoxSurface, ...] = option("boxes")
    surface: geometry.TriangulatedSurface = option("triangles")

    def members(self):
        return {"surface": self.surface}


def vector(values):
    return tuple(float(value) for value in values)


def mesh(rng, count=40):
    """A heap of triangles of unlike sizes, one of zero area, and a distant one."""
    sites = np.concatenate(
        [rng.uniform(-1, 1, (count, 3)) * [1, 1, 0.3], [[9, 9, 9], [9.1, 9, 9], [9, 9.1, 9]]]
    )
    faces = [rng.choice(count, 3, replace=False) for _ in range(count)]
    return geometry.TriangulatedSurface(
        vertices=sites, faces=np.array([*faces, [0, 1, 1], [count, count + 1, count + 2]])
    )


SURFACE = mesh(np.random.default_rng(0))


def some(seed):
    """One shape of each kind, at random; closed and open."""
    rng = np.random.default_rng(seed)
    a, b, c, d = (vector(rng.normal(size=3)) for _ in range(4))
    odd = bool(seed % 2)
    return Shapes(
        planes=(geometry.Plane(point=a, normal=b),),
        discs=(geometry.Disc(centre=a, normal=c, radius=0.7),),
        spheres=(geometry.SphericalSurface(centre=b, radius=0.8),),
        cylinders=(geometry.CylindricalSurface(start=a, end=d, radius=0.6, closed=odd),),
        cones=(
            geometry.ConicalSurface(
                start=b, end=c, start_radius=0.2, end_radius=0.0 if odd else 0.9, closed=not odd
            ),
        ),
        boxes=(geometry.BoxSurface(low=(-1, -0.5, -0.2), high=vector(rng.uniform(0.3, 1, 3))),),
        surface=SURFACE,
    )


def revolved(shape, n=400):
    """Samples of a surface of revolution, and their spacing."""
    start, along, length, low, high = shape.generator()
    axis = np.array(along) / np.linalg.norm(along)
    e = np.linalg.svd(axis[None])[2][1:]
    turn = np.linspace(0, 2 * np.pi, n, endpoint=False)
    ring = np.cos(turn)[:, None] * e[0] + np.sin(turn)[:, None] * e[1]
    lines = [((low, 0.0), (high, length))]
    if getattr(shape, "closed", False):
        lines += [((0.0, 0.0), (low, 0.0)), ((0.0, length), (high, length))]
    u = np.linspace(0, 1, n)[:, None]
    samples = []
    for begin, end in lines:
        rho, z = ((1 - u) * np.array(begin) + u * np.array(end)).T
        samples.append((rho[:, None, None] * ring + (z[:, None] * axis)[:, None]).reshape(-1, 3))
    widest = max(2 * np.pi * max(low, high), np.hypot(length, high - low), low, high) / (n - 1)
    return np.array(start) + np.concatenate(samples), widest


def flat(corner, one, other, n=300):
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    return corner + u.reshape(-1, 1) * one + v.reshape(-1, 1) * other


def boxed(shape):
    low, high = np.array(shape.low), np.array(shape.high)
    size = high - low
    faces = [
        flat(low + side * size[k] * np.eye(3)[k], *(size[m] * np.eye(3)[m] for m in range(3) if m != k))
        for k in range(3)
        for side in (0, 1)
    ]
    return np.concatenate(faces), size.max() / 299


def triangles(shape, n=120):
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    u, v = u[u + v <= 1 + 1e-9], v[u + v <= 1 + 1e-9]
    corners = shape.corners()
    a, one, other = corners[:, :1], corners[:, 1:2] - corners[:, :1], corners[:, 2:] - corners[:, :1]
    return (a + u[:, None] * one + v[:, None] * other).reshape(-1, 3), 2.5 / (n - 1)


@ti.data_oriented
class Distances:
    def __init__(self, bound):
        self.bound, self.lists = bound, tuple((m, getattr(bound, name)) for m, name in enumerate(LISTS))
        self.surface = bound.surface

    @ti.kernel
    def of(self, r: ti.types.ndarray(), out: ti.types.ndarray()):
        for w, i in ti.ndrange(r.shape[0], r.shape[1]):
            place = ti.Vector([r[w, i, 0], r[w, i, 1], r[w, i, 2]])
            for m, shapes in ti.static(self.lists):
                out[w, i, m] = shapes.distance(w, 0, place)
            out[w, i, MESH] = self.surface.distance(w, 0, place)
            out[w, i, MESH + 1] = self.surface.clearance(place)


@in_taichi_thread
def distances(worlds, points):
    real = runtime.current().real
    kind = np.float64 if real == ti.f64 else np.float32
    out = np.zeros((*points.shape[:2], MESH + 2), kind)
    with collected() as trees:
        table = ParameterTable(worlds[:1], len(worlds), real)
        bound = table.bind(worlds[0])
        table.write([[one] for one in worlds])
        Distances(bound).of(points.astype(kind), out)
    for tree in (*trees, *table.trees):
        tree.destroy()
    return out


def beside_cones():
    """Distances of some points from closed cones with an apex at the end, and at the start."""
    cone = {"start": (0.0, 0.0, 0.0), "end": (0.0, 0.0, 1.0), "closed": True}
    radii = ({"start_radius": 1.0, "end_radius": 0.0}, {"start_radius": 0.0, "end_radius": 1.0})
    worlds = [
        some(0).model_copy(update={"cones": (geometry.ConicalSurface(**cone, **each),)}) for each in radii
    ]
    points = np.array([[[0, 0, 2.0], [0, 0, -1.0], [0, 0, 0.5], [2.0, 0, 1.0], [0, 3.0, 0]]] * 2)
    return distances(worlds, points)[:, :, LISTS.index("cones")].tolist()


@pytest.mark.parametrize("arithmetic", ["strict", pytest.param("fast", marks=pytest.mark.slow)])
def test_a_closed_cone_with_an_apex_has_a_distance_everywhere(arithmetic, request):
    """On the axis beyond the apex and beyond the base, within, and beside it."""
    found = beside_cones()
    if arithmetic == "fast":
        found = request.getfixturevalue("in_fast_arithmetic")("geometry.test_shapes", "beside_cones")
    half = 0.5**0.5
    expected = [[1, 1, 0.5 * half, 2 * half, 2], [1, 1, 0.5 * half, 1, 5**0.5]]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.fixture(scope="module")
def measured():
    worlds = [some(seed) for seed in range(3)]
    points = np.random.default_rng(5).uniform(-2.5, 2.5, (3, POINTS, 3))
    # Also on axes and in corners.
    for w, shapes in enumerate(worlds):
        points[w, 0] = shapes.cylinders[0].start
        points[w, 1] = shapes.spheres[0].centre
        points[w, 2] = shapes.boxes[0].low
        points[w, 3] = SURFACE.corners()[3, 1]
    return worlds, points, distances(worlds, points)


def test_distances_agree_with_samples_of_faces(measured):
    worlds, points, out = measured
    for w, shapes in enumerate(worlds):
        for m, name in enumerate(LISTS):
            (shape,) = getattr(shapes, name)
            if name == "planes":
                normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
                np.testing.assert_allclose(out[w, :, m], (points[w] - shape.point) @ normal, atol=1e-12)
                continue
            if name == "spheres":
                expected = np.abs(np.linalg.norm(points[w] - shape.centre, axis=1) - shape.radius)
                np.testing.assert_allclose(out[w, :, m], expected, atol=1e-12)
                continue
            check(points[w], out[w, :, m], *(boxed(shape) if name == "boxes" else revolved(shape)))
        check(points[w], out[w, :, MESH], *triangles(SURFACE))


def check(points, distance, samples, apart):
    sampled = cKDTree(samples).query(points)[0]
    assert (distance <= sampled + 1e-12).all()
    # On a surface of curvature below 5 / m, the true distance of a point is at most this much smaller than a
    # sample's.
    assert (np.sqrt(distance**2 + (1 + 5 * distance) * apart**2) >= sampled).all()
    assert sampled.max() > 1


def test_cells_give_lower_bounds_of_distances(measured):
    """The bound is never above the distance, and often better than the bound from the box around all
    triangles."""
    *_, out = measured
    true, told = out[..., MESH], out[..., MESH + 1]
    assert (told <= true + 1e-12).all()
    assert (told > 0).mean() > 0.1


def tetrahedron():
    """The text of an STL file, in which each triangle has its own vertices."""
    facet = "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n"
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
    text = "".join(facet.format("".join(f"vertex {x} {y} {z}\n" for x, y, z in corners[f])) for f in faces)
    return f"solid t\n{text}endsolid t\n"


def test_a_file_is_read(tmp_path):
    """A tetrahedron has four vertices."""
    (tmp_path / "t.stl").write_text(tetrahedron())
    surface = geometry.TriangulatedSurface.read(tmp_path / "t.stl", scale=1e-3)
    assert surface.vertices.shape == (4, 3)
    np.testing.assert_allclose(np.sort(surface.corners(), axis=None)[-1], 1e-3)
    assert len(surface.corners()) == 4
    (tmp_path / "none.stl").write_text("nothing")
    for path in ("none.stl", "missing.stl"):
        with pytest.raises(InputError, match=r"^surface must be an? (STL file|file that can be read)"):
            geometry.TriangulatedSurface.read(tmp_path / path)


@pytest.mark.parametrize("scale", [-1.0, 0.0, float("nan"), "1", True])
def test_an_invalid_scale_is_refused(scale, tmp_path):
    """A negative scale would mirror the surface."""
    (tmp_path / "t.stl").write_text(tetrahedron())
    with pytest.raises(InputError, match=r"^surface.scale must be a number of m above 0; received "):
        geometry.TriangulatedSurface.read(tmp_path / "t.stl", scale)


def in_a_scene(tmp_path, surface):
    """A scene file with a surface in its walls, written as given; beside it a folder with t.stl."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "t.stl").write_text(tetrahedron())
    path = tmp_path / "scene.toml"
    path.write_text(
        "duration = 1.0\n"
        "particles = {kind = 'particles', position = [[0, 0, 9]], velocity = [[0, 0, 0]], radius = 1, "
        "mass = 1}\n[stepper.control]\nkind = 'fixed_step'\ndt = 1e-3\n"
        "[materials.steel]\nyoung = 1e7\npoisson = 0.3\n[effects.granular]\n"
        "[effects.hopper]\nkind = 'walls'\n"
        f"[effects.hopper.surface]\nkind = 'triangulated_surface'\n{surface}\n"
    )
    return path


def test_a_scene_file_names_the_file_of_a_surface(tmp_path, monkeypatch):
    """The file name is relative to the folder of the scene file; the scene stores the triangles, and needs no
    file."""
    path = in_a_scene(tmp_path, 'file = "parts/t.stl"\nscale = 1e-3')
    monkeypatch.chdir(tmp_path / "parts")
    for made in (Scene.from_toml(path), tisim.read(path)):
        assert made.effects[1].surface == geometry.TriangulatedSurface.read("t.stl", scale=1e-3)
        assert Scene.from_dict(made.to_dict()) == made


FILES = {
    "file = 'parts/t.st'": r"hopper.surface.file must be an existing file; received '.*parts/t.st'",
    "file = 3": r"hopper.surface.file must be text; received 3",
    "file = 'parts'": r"surface must be a regular file; received a folder .*parts",
    "file = 'parts/t.stl'\nscale = 0": r"hopper.surface.scale must be a number of m above 0; received 0",
    "file = 'parts/t.stl'\nfaces = []": "hopper.surface must be given a file and a scale alone, or "
    "vertices and faces; received 'faces'",
}


@pytest.mark.parametrize(("surface", "message"), FILES.items())
def test_invalid_files_of_surfaces_are_refused(surface, message, tmp_path):
    with pytest.raises(InputError, match=message):
        Scene.from_toml(in_a_scene(tmp_path, surface))


LONG = "cylindrical_surface.end - cylindrical_surface.start must be a direction; received (0.0, 0.0, 0.0)"
INDEX = "triangulated_surface.faces must be whole numbers below the number of vertices, 3; received [3.0]"
HIGH = "box_surface.high must be above low, (0.0, 0.0, 0.0), along each axis; received (1.0, 1.0, 0.0)"
WRONG = {
    LONG: lambda: geometry.CylindricalSurface(end=(0, 0, 0), radius=1),
    "conical_surface.start_radius and end_radius must be not both 0; received (0.0, 0.0)": lambda: (
        geometry.ConicalSurface(end=(0, 0, 1), start_radius=0, end_radius=0)
    ),
    "disc.normal must be a direction; received (0.0, 0.0, 0.0)": lambda: geometry.Disc(
        normal=(0, 0, 0), radius=1
    ),
    HIGH: lambda: geometry.BoxSurface(high=(1, 1, 0)),
    INDEX: lambda: geometry.TriangulatedSurface(vertices=np.eye(3), faces=[[0, 1, 3]]),
    "triangulated_surface.faces must be triangles with an area; received none": lambda: (
        geometry.TriangulatedSurface(vertices=np.eye(3), faces=[[0, 1, 1]])
    ),
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        WRONG[message]()
    assert str(fault.value) == message
