"""The field of magnetised cylinders, compared with B16's formulas in many digits, magpylib, and field
laws."""

import magpylib
import numpy as np
import pytest
from scipy.constants import mu_0
from scipy.spatial.transform import Rotation

from tests.sources.fields import WORLDS, fields, relative, steepness
from tests.sources.published import anywhere, by_quadrature, field_and_gradient, from_rim
from tisim.backend.runtime import current
from tisim.sources import Cylinder, MagneticCylinders, sample
from tisim.sources.magnetic.cylinder_frame import split_magnetisation

M = (0.3e6, -0.5e6, 0.8e6)


def one(half, radius=1.0, m=M):
    return MagneticCylinders(cylinders=[Cylinder(radius=radius, length=2 * half, magnetisation=m)])


def in_plane(rho, z, angle=0.7):
    return [rho * np.cos(angle), rho * np.sin(angle), z]


def difficult_points(half, rng, n=3):
    """Difficult points for radius 1: on and beside the axis, at rho = R, at the rim, in the end planes, far
    away."""
    small = 10.0 ** rng.uniform(-12, -1, n)
    turn = rng.uniform(0, 2 * np.pi, n)
    wide = 10.0 ** rng.uniform(0.5, 5, n)
    z = half * rng.uniform(-2, 2, n)
    up = half * np.sign(z)
    return np.array(
        [
            *(in_plane(0.0, h) for h in z),
            *(in_plane(r, h) for r, h in zip(small, z, strict=True)),
            *(in_plane(1 + r * s, h) for r, h, s in zip(small, z, np.sign(turn - 3), strict=True)),
            *([1.0, 0.0, h] for h in z if abs(h) > half),
            *(
                in_plane(1 + d * np.cos(a), h + d * np.sin(a))
                for d, a, h in zip(small, turn, up, strict=True)
            ),
            *(in_plane(2 * d, h) for d, h in zip(rng.uniform(0.6, 2, n), up, strict=True)),
            *(in_plane(d * abs(np.cos(a)), d * np.sin(a)) for d, a in zip(wide, turn, strict=True)),
            *(in_plane(*p) for p in rng.uniform([0, -2 * half], [3, 2 * half], (n, 2))),
        ]
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "halves",
    [
        (0.05, 5 / 3),
        *(pytest.param(n, marks=pytest.mark.slow) for n in ((0.5, 1.0), (20 / 3, 20.0, 100.0, 1000.0))),
    ],
)
def test_field_and_gradient_at_the_hard_places(halves, rng):
    """Relative errors are below 1e-12 for the field and its gradient, wherever they are finite."""
    places = [difficult_points(half, rng) for half in halves]
    n = min(len(p) for p in places)
    places = np.array([p[:n] for p in places])
    b, slope = fields([one(half) for half in halves], places)
    for w, half in enumerate(halves):
        expected = [field_and_gradient(p, 1.0, half, M) for p in places[w]]
        field, gradient = (np.array(v) for v in zip(*expected, strict=True))
        rho, z = np.hypot(*places[w].T[:2]), np.abs(places[w][:, 2])
        size = steepness(field, gradient, places[w], half)
        # The position, and therefore its distance from the rim, is known to rounding only.
        rounding = 1e-12 + 4 * 2.3e-16 / np.hypot(rho - 1, z - half)
        assert (relative(b[w], field) / rounding).max() < 1
        assert (np.linalg.norm(slope[w] - gradient, axis=(1, 2)) / size / rounding).max() < 1


def inclined(ratio, towards, rng):
    """A cylinder of this length (in radii) at a random place in a random direction.

    towards : direction of the magnetisation.
    """
    # Direction and parallel vectors use all digits.
    axis = rng.normal(size=3)
    across = np.cross(axis, rng.normal(size=3))
    m = {
        "along": 3e5 * axis,
        "nearly along": 3e5 * axis + 10.0 ** rng.uniform(-16, -3) * across,
        "across": 3e5 * across,
        "anywhere": 3e5 * (axis + across),
    }[towards]
    radius = 10.0 ** rng.uniform(-4, 1)
    return {
        "centre": radius * rng.normal(size=3) * 10.0 ** rng.uniform(-1, 2),
        "axis": axis, "radius": radius, "length": ratio * radius, "magnetisation": m,
    }  # fmt: skip


def about(body, n, rng):
    """Points beside its surface, inside it, around its rim, and farther away."""
    radius, half, up = body["radius"], 0.5 * body["length"], body["axis"] / np.linalg.norm(body["axis"])
    kind = np.arange(n) % 4
    small, turn = 10.0 ** rng.uniform(-8, -1, n), rng.uniform(0, 2 * np.pi, n)
    rho = np.choose(kind, [1 + 10.0 ** rng.uniform(-12, 1, n), rng.uniform(0, 1, n), 1 + small * np.cos(turn),
                           10.0 ** rng.uniform(0, 4, n)])  # fmt: skip
    z = np.where(kind == 2, half + radius * small * np.sin(turn), half * rng.uniform(-1.2, 1.2, n))
    across = np.cross(up, rng.normal(size=(n, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    return body["centre"] + z[:, None] * up + radius * rho[:, None] * across


def errors_of_inclined(ratios, n, rng):
    """Errors of field and gradient, as fractions of the bound in the docstring.

    There is a row for each point, for long bodies with every direction of the magnetisation.
    """
    errors = []
    for towards in ("along", "nearly along", "across", "anywhere"):
        bodies = [inclined(ratio, towards, rng) for ratio in ratios]
        places = np.array([about(body, n, rng) for body in bodies])
        b, slope = fields([MagneticCylinders(cylinders=[Cylinder(**body)]) for body in bodies], places)
        for w, body in enumerate(bodies):
            radius = body["radius"]
            for k, point in enumerate(places[w]):
                field, gradient = anywhere(point, **body)
                side, end = from_rim(point, body["centre"], body["axis"], radius, body["length"])
                size = np.linalg.norm(gradient) + np.linalg.norm(field) / np.hypot(abs(side) + radius, end)
                allowed = 1e-12 + 1e-15 * radius / np.hypot(side, end)
                off = np.linalg.norm(b[w, k] - field) / np.linalg.norm(field)
                errors.append([off / allowed, np.linalg.norm(slope[w, k] - gradient) / size / allowed])
    return np.array(errors)


@pytest.mark.long
def test_long_cylinders_in_any_direction(rng):
    """Beside a cylinder magnetised along its axis the field is 1e-7 of the field with transverse
    magnetisation."""
    assert errors_of_inclined((1.0, 30.0, 300.0, 2000.0), 3, rng).max() < 1


@pytest.mark.slow
def test_many_cylinders_in_any_direction(rng):
    for _ in range(4):
        ratios = 10.0 ** rng.uniform(-1, np.log10(2000), WORLDS)
        assert errors_of_inclined(ratios, 12, rng).max() < 1


def test_parallel_vectors_stay_parallel_and_files_keep_all_digits():
    """The direction is not rounded before it is used."""
    body = Cylinder(axis=(1, 2, 3), radius=1, length=2, magnetisation=(1e5, 2e5, 3e5))
    assert body.axis == (1, 2, 3)
    assert np.linalg.norm(body.direction) == pytest.approx(1, abs=3e-16)
    across, along = split_magnetisation(body.axis, body.magnetisation)
    assert across == (0, 0, 0)
    assert along == np.sqrt(14) * 1e5
    for axis in ((1e-90, 0, 0), (3e99, 4e99, 0), (1e-99, 1e-99, 0)):
        assert np.linalg.norm(Cylinder(axis=axis, radius=1, length=2).direction) == pytest.approx(1)


def test_the_published_formulas_are_right():
    """Numerical integrals over surface charges and currents agree, so the reference is valid."""
    for point in ([0.4, 0.3, 0.2], [1.5, -0.4, 0.9], [0.1, 0.0, -2.5], [1e-3, 2e-3, 0.5]):
        np.testing.assert_allclose(
            by_quadrature(point, 1.0, 1.2, M), field_and_gradient(point, 1.0, 1.2, M)[0], rtol=1e-14
        )


def scattered(rng, n):
    """Cylinders at random positions and orientations."""
    return MagneticCylinders(
        cylinders=[
            Cylinder(
                centre=rng.normal(size=3) * 3,
                axis=rng.normal(size=3),
                radius=rng.uniform(0.3, 2),
                length=rng.uniform(0.3, 4),
                magnetisation=rng.normal(size=3) * 1e6,
            )
            for _ in range(n)
        ]
    )


def peer(source, points):
    """The field by magpylib, in T."""
    total = np.zeros_like(points)
    for cylinder in source.cylinders:
        turned = Rotation.align_vectors([cylinder.axis], [[0, 0, 1]])[0]
        magnet = magpylib.magnet.Cylinder(
            magnetization=turned.inv().apply(cylinder.magnetisation),
            dimension=(2 * cylinder.radius, cylinder.length),
            position=cylinder.centre,
            orientation=turned,
        )
        total += magnet.getB(points)
    return total


STEP = 1e-5
"""Step (m) of the differences."""


def peer_gradient(source, points):
    """dB_a/dr_c from central differences of magpylib fields.

    They divide errors of the field by STEP. The truncation error, STEP^2/6 times the third derivative, is
    smaller.
    """
    steps = STEP * np.eye(3)
    slopes = [(peer(source, points + d) - peer(source, points - d)) / (2 * STEP) for d in steps]
    return np.stack(slopes, axis=-1)


def test_against_an_independent_library(rng):
    """Worlds with 1, 2, 5 and 20 cylinders, at thousands of points inside and outside.

    The bound for the gradient is the bound for the field over STEP.
    """
    worlds = [scattered(rng, n) for n in (1, 2, 5, 20)]
    points = rng.normal(size=(WORLDS, 1500, 3)) * 2.5
    b, slope = fields(worlds, points)
    inside = 0
    for w, world in enumerate(worlds):
        expected = peer(world, points[w])
        off = np.linalg.norm(slope[w] - peer_gradient(world, points[w]), axis=(1, 2))
        for apart in relative(b[w], expected), STEP * off / np.linalg.norm(expected, axis=1):
            assert apart.max() < 1e-9
            assert np.median(apart) < 1e-12
        for c in world.cylinders:
            d = points[w] - c.centre
            z = d @ np.array(c.direction)
            rho = np.linalg.norm(d - z[:, None] * np.array(c.direction), axis=1)
            inside += ((rho < c.radius) & (np.abs(z) < c.length / 2)).sum()
    assert inside > 300


def test_the_library_is_wrong_at_the_largest_differences(rng):
    """At the points of the largest difference, the published formulas agree with this field."""
    world, points = one(0.8), rng.normal(size=(3000, 3)) * 5
    results, expected = fields([world], points[None]), (peer(world, points), peer_gradient(world, points))
    for k, (ours, theirs, least) in enumerate(zip(results, expected, (1e-13, 1e-8), strict=True)):
        worst = np.argsort(-relative(ours[0], theirs))[:3]
        true = np.array([field_and_gradient(p, 1.0, 0.8, M)[k] for p in points[worst]])
        assert relative(ours[0][worst], true).max() < 1e-14
        assert relative(theirs[worst], true).min() > least


def test_a_world_is_the_same_alone_and_in_a_batch(rng):
    """Worlds with different numbers of cylinders, to the last bit."""
    worlds = [scattered(rng, n) for n in (3, 0, 30, 7)]
    points = rng.normal(size=(WORLDS, 200, 3)) * 4
    together = fields(worlds, points)
    for w, world in enumerate(worlds):
        alone = fields([world], points[w : w + 1])
        for a, b in zip(together, alone, strict=True):
            np.testing.assert_array_equal(a[w], b[0])
    assert (together[0][1] == 0).all()
    assert (together[0][2] != 0).all()


def test_many_points_at_once_equal_single_points(rng):
    """Most points are evaluated in vectors; points near the axis, far away and at the rim are not.

    The results are equal to the last bit if the compiler has no choice between fused and rounded products.
    """
    points = np.concatenate([difficult_points(1.0, rng), rng.normal(size=(60, 3)) * 2])
    magnets = MagneticCylinders(cylinders=[*one(1.0).cylinders, *scattered(rng, 2).cylinders])
    alone, together = fields([magnets], points[None]), sample([magnets], magnets.quantity, points)
    exact = current().device == "cpu" and current().arithmetic == "strict"
    for a, b in zip(alone, together, strict=True):
        np.testing.assert_allclose(b, a[0], rtol=0 if exact else 1e-9)


def test_sums_and_rotations(rng):
    """The field of several cylinders is the sum of their fields, and it rotates with them."""
    many = scattered(rng, 4)
    points = rng.normal(size=(1, 300, 3)) * 4
    b, slope = fields([many], points)
    each = fields([MagneticCylinders(cylinders=[c]) for c in many.cylinders], np.repeat(points, 4, axis=0))
    np.testing.assert_allclose(each[0].sum(axis=0), b[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(each[1].sum(axis=0), slope[0], rtol=0, atol=1e-12)
    turn = Rotation.from_rotvec([0.3, -1.2, 2.0])
    turned = MagneticCylinders(
        cylinders=[
            Cylinder(
                centre=turn.apply(c.centre),
                axis=turn.apply(c.axis),
                magnetisation=turn.apply(c.magnetisation),
                radius=c.radius,
                length=c.length,
            )
            for c in many.cylinders
        ]
    )
    rotated, _ = fields([turned], turn.apply(points[0])[None])
    np.testing.assert_allclose(rotated[0], turn.apply(b[0]), rtol=0, atol=1e-12)


def test_laws_of_maxwell(rng):
    """div B = 0 and curl H = 0 for the computed gradient, which also equals differences of the field."""
    worlds = [scattered(rng, n) for n in (1, 2, 3, 4)]
    points = rng.normal(size=(WORLDS, 200, 3)) * 4
    _, slope = fields(worlds, points)
    size = np.linalg.norm(slope, axis=(2, 3))
    assert (np.abs(np.trace(slope, axis1=2, axis2=3)) <= 1e-14 * size).all()
    assert (np.abs(slope - np.swapaxes(slope, 2, 3)).max(axis=(2, 3)) <= 1e-14 * size).all()
    step, slope_by_difference = 1e-4, np.zeros_like(slope)
    for k, weight in ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12)):
        for c in range(3):
            slope_by_difference[..., c] += weight / step * fields(worlds, points + k * step * np.eye(3)[c])[0]
    error = np.linalg.norm(slope_by_difference - slope, axis=(2, 3)) / size
    # Near a surface a difference extends across it.
    assert np.median(error) < 1e-9
    assert np.quantile(error, 0.95) < 1e-5


def test_limits():
    """B16 section 5.5: an infinite cylinder (5.24), the field on the axis (5.26), the dipole (5.31)."""
    half, m = 1e5, 1e6
    h = m / 2
    long = one(half, m=(m, 0, 0))
    places = np.array([[[0.3, 0.2, 0], [3.0, 0, 0], [0, 3.0, 0], [0, -0.5, 40.0]]])
    b, _ = fields([long], places)
    expected = [[m - h, 0, 0], [h / 9, 0, 0], [-h / 9, 0, 0], [m - h, 0, 0]]
    np.testing.assert_allclose(b[0], mu_0 * np.array(expected), rtol=0, atol=1e-9 * mu_0 * m)
    heights = np.array([0.0, 0.5, 1.999, 2.001, 7.0])
    b, _ = fields([one(2.0, m=(m, 0, 0))], np.array([[[0, 0, z] for z in heights]]))
    up, down = heights + 2, heights - 2
    axis = -m / 4 * (up / np.hypot(up, 1) - down / np.hypot(down, 1)) + m * (heights < 2)
    np.testing.assert_allclose(b[0][:, 0], mu_0 * axis, rtol=1e-13)
    far = np.array([[[3e4, 0, 4e4], [0, 5e6, 0], [1e9, 2e9, -2e9]]])
    b, _ = fields([one(2.0)], far)
    moment = np.array(M) * np.pi * 4.0
    r = np.linalg.norm(far[0], axis=1)[:, None]
    dipole = mu_0 / (4 * np.pi) * (3 * far[0] * (far[0] @ moment)[:, None] / r**5 - moment / r**3)
    np.testing.assert_allclose(b[0], dipole, rtol=0, atol=1e-8 * np.linalg.norm(dipole[0]))
    assert relative(b[0][1:], dipole[1:]).max() < 1e-11


def test_passing_the_rim_the_axis_and_the_surface():
    """The field is finite everywhere, also at singular points, and jumps only at the surface."""
    edge = [[1.0, 0, 1.0], [0, -1.0, -1.0], [1.0, 0, 0.3], [0.2, 0, 1.0], [0, 0, 1.0], [0, 0, 0]]
    b, slope = fields([one(1.0)], [edge])
    assert np.isfinite(b).all()
    assert np.isfinite(slope).all()
    for path in (
        np.linspace([-2, 0, 1.5], [2, 0, 1.5], 4001),
        np.linspace([1 + 1e-6, 0, 0], [1 + 1e-6, 0, 2], 4001),
        np.linspace([1.2, 0.1, 5], [1.2, 0.1, 12], 4001),
    ):
        b, slope = fields([one(1.0)], [path])
        step = path[1] - path[0]
        middle = 0.5 * (slope[0, 1:] + slope[0, :-1]) @ step
        change = np.linalg.norm(np.diff(b[0], axis=0) - middle, axis=1)
        away = np.hypot(np.hypot(*path[1:].T[:2]) - 1, path[1:, 2] - 1)
        assert (change[away > 0.02] < 1e-3 * np.abs(b).max() * np.linalg.norm(step) / 0.02).all()
