"""Rods and superquadrics that touch spheres, cylinders and cones, against searches over their surfaces and
conservation laws."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from tests.effects.constraint.shapes import BALL, BRICK, DENSITY, EGG, ROD, D, energy, moving, whole_momentum
from tests.effects.constraint.test_rigid_shapes import ELASTIC, LAW, WEIGHT, material
from tests.engine.test_crowding import found
from tests.scenes import by_id, fixed, simulate
from tests.shapes.pairs import spiral, unit
from tisim import InputError, Material, Particles, Scene
from tisim.effects import Granular, Hooke, Walls
from tisim.effects import Rotation as Turning
from tisim.geometry import BoxSurface, ConicalSurface, CylindricalSurface, Disc, SphericalSurface

pytestmark = pytest.mark.long
SHAPES = (ROD, BALL, EGG, BRICK)
R = 6 * D
FAR = 0.1
TILT = np.array([0.48, -0.6, 0.64])
"""Axis of the cylinder and the cone."""
CYLINDER = CylindricalSurface(start=tuple(-0.02 * TILT), end=tuple(0.02 * TILT), radius=R)
SPHERE = SphericalSurface(centre=(FAR, 0, 0), radius=R)
APEX = np.array([0, FAR, 0])
CONE = ConicalSurface(
    start=tuple(APEX - 0.02 * TILT), end=tuple(APEX + 0.02 * TILT), start_radius=0.3 * R, end_radius=2 * R
)
STIFF = 1e3
SOFT = {"materials": {"grain": Material(stiffness=STIFF, friction=0.5)}}
ROUND = Walls(cylinders=[CYLINDER], spheres=[SPHERE], cones=[CONE])


def beyond(kind, points):
    """Distance (m) of points beyond a wall, negative inside, and the unit normal there away from the axis."""
    if kind == "sphere":
        away = points - np.array(SPHERE.centre)
        size = np.linalg.norm(away, axis=-1, keepdims=True)
        return size[..., 0] - R, away / size
    away = points - (APEX if kind == "cone" else 0.0)
    height = away @ TILT
    across = away - height[..., None] * TILT
    rho = np.linalg.norm(across, axis=-1, keepdims=True)
    # The radius of the cone grows from 0.3 to 2 R over 0.04 m, and is 1.15 R in the middle.
    slope, middle = (1.7 * R / 0.04, 1.15 * R) if kind == "cone" else (0.0, R)
    cosine = 1 / np.hypot(1, slope)
    normal = cosine * (across / rho - slope * TILT)
    return cosine * (rho[..., 0] - slope * height - middle), normal


def searched(kind, shape, turn, centre, outside):
    """The deepest overlap (m) of a body with a wall, its normal and its point, by a search over points of its
    surface: those farthest along a spiral of normals, and then along normals around the best ones."""
    if outside and shape in (ROD, BALL):
        # The side of a rod is farthest along single normals only. The distance is convex along its segment.
        half = turn.apply([0, 0, shape.length / 2])
        on = minimize_scalar(
            lambda x: beyond(kind, centre + x * half)[0] / D,
            bounds=(-1, 1),
            method="bounded",
            options={"xatol": 1e-10},
        )
        place = centre + on.x * half
        distance, normal = beyond(kind, place)
        return shape.radius - distance, -normal, place - shape.radius * normal - centre
    sign, rng = (-1.0 if outside else 1.0), np.random.default_rng(0)

    def depths(normals):
        points = centre + turn.apply(shape.support(turn.inv().apply(normals)))
        return sign * beyond(kind, points)[0], points

    normals, kept = spiral(4000), 12
    deep, points = depths(normals)
    best = normals[np.argsort(-deep)[:kept]]
    for cap in 0.2 * 0.6 ** np.arange(45):
        trials = unit(best[:, None] + cap * rng.normal(size=(kept, 30, 3))).reshape(-1, 3)
        trials = np.concatenate([best, trials])
        deep, points = depths(trials)
        best = trials[np.argsort(-deep)[:kept]]
    k = deep.argmax()
    return deep[k], sign * beyond(kind, points[k])[1], points[k] - centre


def placed(rng, kind, shape, turn, outside, depth):
    """A place where a body overlaps a wall by about a depth (m), on either side."""
    axis = {"sphere": np.array(SPHERE.centre), "cylinder": np.zeros(3), "cone": APEX}[kind]
    away = unit(rng.normal(size=3))
    across = away if kind == "sphere" else unit(away - (away @ TILT) * TILT)
    along = 0.0 if kind == "sphere" else rng.uniform(-3, 3) * D
    side = -1.0 if outside else 1.0
    low, high = (0.0, R) if not outside else (R, 3 * R)
    centre = axis
    for _ in range(60):
        middle = (low + high) / 2
        centre = axis + middle * across + along * TILT
        points = centre + turn.apply(shape.surface_points(300))
        deep = (side * beyond(kind, points)[0]).max() > depth
        low, high = (low, middle) if deep != outside else (middle, high)
    return centre


def expected(kind, shape, turn, centre, outside):
    """Force (N) and torque (N m) of a wall on a body under Hooke's law, from the search; a rod inside touches
    by both of its ends."""
    force, torque, overlaps = np.zeros(3), np.zeros(3), []
    if shape in (ROD, BALL) and not outside:
        for side in (1, -1) if shape is ROD else (0,):
            arm = turn.apply([0, 0, side * shape.length / 2])
            deep, normal = beyond(kind, centre + arm)
            deep += shape.radius
            overlaps.append(deep)
            if deep > 0:
                push = -STIFF * deep * normal
                lever = arm + (shape.radius - deep / 2) * normal
                force, torque = force + push, torque + np.cross(lever, push)
        return force, torque, overlaps
    deep, normal, point = searched(kind, shape, turn, centre, outside)
    overlaps.append(deep)
    if deep > 0:
        push = -STIFF * deep * normal
        force, torque = push, np.cross(point - deep / 2 * normal, push)
    return force, torque, overlaps


@pytest.mark.slow
def test_the_force_of_a_wall_is_the_one_of_the_deepest_point_of_the_surface(rng):
    """Rods, spheres, ellipsoids and bricks, inside the walls, and outside the sphere and the cylinder."""
    sites = [(kind, out) for kind in ("cylinder", "sphere", "cone") for out in (False, True)][:5]
    cases = [(*site, k) for site in sites for k in range(4) for _ in range(3)]
    turns = Rotation.random(len(cases), rng=rng)
    places = [
        placed(rng, kind, SHAPES[k], turn, out, 0.1 * D)
        for (kind, out, k), turn in zip(cases, turns, strict=True)
    ]
    given = {"shape": [k for *_, k in cases], "orientation": turns.as_quat(scalar_first=True)}
    law = Granular(normal=Hooke())
    loads = []
    for (kind, out, k), turn, place in zip(cases, turns, places, strict=True):
        loads.append(expected(kind, SHAPES[k], turn, place, out))
    touching = sum(max(deep) > 0.01 * D for *_, deep in loads)
    assert touching > 0.9 * len(cases)
    results = []
    for m in range(len(cases)):
        one = {name: [values[m]] for name, values in given.items()}
        results.append(moving(SHAPES, [places[m]], (law, ROUND), 1e-9, 1, **one, **SOFT))
    states = [
        one.state for batch in range(0, len(results), 20) for one in simulate(results[batch : batch + 20], 20)
    ]
    for case, state, (force, torque, _) in zip(cases, states, loads, strict=True):
        load = state["walls_loads"][0]
        np.testing.assert_allclose(load[:3], force, rtol=0, atol=1e-5 * STIFF * D, err_msg=str(case))
        # Points of flat faces are known less well than depths.
        np.testing.assert_allclose(load[3:], torque, rtol=0, atol=1e-4 * STIFF * D * D, err_msg=str(case))


def flying(shape, walls, place, dt, time=0.02, law=ELASTIC, **more):
    given = {"velocity": (0.3, 0.1, 0.05), "angular_velocity": (30, 20, -50), "materials": material(), **more}
    turn = Rotation.from_rotvec([0.3, 0.5, 0.2]).as_quat(scalar_first=True)
    return moving(shape, [place], (law, walls), dt, round(time / dt), orientation=turn, **given)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [ROD, EGG, BRICK], ids=["rod", "egg", "brick"])
@pytest.mark.parametrize("kind", ["cylinder", "sphere", "cone"])
def test_elastic_collisions_keep_energy_and_the_momenta_of_the_symmetry(shape, kind):
    """About the axis of a cylinder or a cone, and along the axis of a cylinder; about the centre of a
    sphere."""
    walls = {
        "cylinder": Walls(cylinders=[CylindricalSurface(start=(0, 0, -FAR), end=(0, 0, FAR), radius=R)]),
        "sphere": Walls(spheres=[SphericalSurface(radius=R)]),
        "cone": Walls(cones=[ConicalSurface(
            start=(0, 0, -0.02), end=(0, 0, 0.02), start_radius=0.3 * R, end_radius=2 * R)]),
    }[kind]  # fmt: skip
    errors = []
    for dt in (4e-6, 2e-6, 1e-6):
        (result,) = simulate([flying(shape, walls, (1e-3, 0.5e-3, 0), dt)])
        assert result.status.ok, result.status.reason
        start, end = result.start, result.state
        assert np.abs(end["velocity"] - start["velocity"]).max() > 0.1
        errors.append(abs(energy(end) / energy(start) - 1))
        before, after = whole_momentum(start), whole_momentum(end)
        kept = slice(0, 3) if kind == "sphere" else slice(2, 3)
        size = end["mass"][0] * 0.3 * R
        np.testing.assert_allclose(after[kept], before[kept], rtol=0, atol=1e-10 * size)
        if kind == "cylinder":
            np.testing.assert_allclose(end["velocity"][:, 2], start["velocity"][:, 2], rtol=1e-12)
    assert errors[0] < 5e-5
    assert errors[2] < 5e-6


@pytest.mark.slow
def test_a_rod_of_length_0_in_a_turning_drum_is_a_sphere():
    """With friction and rolling resistance; the difference is of first order in dt."""
    drum = Walls(
        cylinders=[CylindricalSurface(start=(0, -FAR, 0), end=(0, FAR, 0), radius=R)],
        motion=Turning(rate=(0, 20.0, 0)),
    )
    place, errors = [(1e-3, 0, -4.99 * D)], []
    for dt, steps in ((2e-6, 8000), (1e-6, 16_000)):
        made = moving(BALL, place, (LAW, WEIGHT, drum), dt, steps, materials=material(),
                      velocity=(0.05, 0.02, 0))  # fmt: skip
        particles = Particles(position=place, velocity=[(0.05, 0.02, 0)], radius=D, density=DENSITY)
        sphere = Scene(particles=particles, effects=(LAW, WEIGHT, drum), stepper=fixed(dt),
                       duration=dt * steps, materials=material())  # fmt: skip
        (one,), (other,) = simulate([made]), simulate([sphere])
        assert one.status.ok, one.status.reason
        assert np.abs(other.state["spin"]).max() > 10
        errors.append([np.abs(one.state[k] - other.state[k]).max() for k in ("position", "velocity", "spin")])
    assert (np.array(errors[1]) < [1e-6, 1e-4, 1e-1]).all(), errors


@pytest.mark.slow
def test_an_ellipsoid_comes_to_rest_in_a_cylinder():
    """It rolls down; the wall carries its weight."""
    trough = Walls(cylinders=[CylindricalSurface(start=(0, -FAR, 0), end=(0, FAR, 0), radius=R)])
    made = moving(EGG, [(1e-3, 0, -4 * D)], (LAW, WEIGHT, trough), 4e-6, 100_000, materials=material(),
                  orientation=Rotation.from_rotvec([np.pi / 2, 0, 0]).as_quat(scalar_first=True))  # fmt: skip
    (result,) = simulate([made])
    assert result.status.ok, result.status.reason
    weight = result.state["mass"][0] * 9.81
    assert result.measures["walls_force_z"] == pytest.approx(-weight, rel=0.02)
    assert np.linalg.norm(by_id(result)["velocity"]) < 5e-3


@pytest.mark.slow
def test_a_body_at_a_rim_or_outside_a_cone_stops_the_world():
    short = CylindricalSurface(start=(0, 0, 0), end=(0, 0, 0.02), radius=R)
    cone = ConicalSurface(start=(FAR, 0, 0), end=(FAR, 0, 0.02), start_radius=R, end_radius=D)
    walls = Walls(cylinders=[short], cones=[cone])
    for x, z, ends in (
        (R - 0.9 * D, -0.3 * D, True),
        (FAR + 5.6 * D, 5 * D, True),
        (R - 0.9 * D, 0.3 * D, False),
    ):
        (result,) = simulate([moving(BALL, [(x, 0, z)], (ELASTIC, walls), 1e-6, 5, materials=material())])
        assert result.status.ok != ends
        assert ("a body with a shape touches a rim, or a cone from outside" in result.status.reason) == ends


REFUSED = {
    "discs": Walls(discs=[Disc(radius=1.0)]),
    "boxes": Walls(boxes=[BoxSurface(high=(1, 1, 1))]),
    "closed cylinders": Walls(cylinders=[CylindricalSurface(end=(0, 0, 1), radius=1, closed=True)]),
    "closed cones": Walls(cones=[ConicalSurface(end=(0, 0, 1), start_radius=1, end_radius=2, closed=True)]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_other_surfaces_are_refused_by_name(name):
    rule = (
        "effects.walls must be made of planes, spheres, and open cylinders and cones, with effects.rigid_rods"
    )
    with pytest.raises(InputError, match=f"{rule}; received '{name}'"):
        simulate([moving(ROD, [(0, 0, 0)], (ELASTIC, REFUSED[name]), materials=material())])


@pytest.mark.parametrize("kind", ["cylinder", "sphere", "cone"])
@pytest.mark.parametrize("outside", [False, True])
def test_a_body_in_a_curved_wall_gives_a_warning(kind, outside, rng):
    """With the overlap of the search over its surface; outside a cone it is not known."""
    for shape in (ROD, BRICK):
        turn = Rotation.random(rng=rng)
        for depth in (0.3 * D, 0.45 * D):
            centre = placed(rng, kind, shape, turn, outside, depth)
            deep, *_ = searched(kind, shape, turn, centre, outside)
            part = deep / shape.half_extents().min()
            words = found(moving(shape, [centre], (ELASTIC, ROUND), materials=material(),
                                 orientation=turn.as_quat(scalar_first=True)))  # fmt: skip
            if kind == "cone" and outside:
                assert words == ""
            elif part > 0.5:
                assert f"particle 0 lies in effects.walls by {deep:.3g} m, {part:.3g} of its half" in words
            else:
                assert words == ""
