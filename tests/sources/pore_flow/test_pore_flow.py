"""The flow through a matrix as a source: interpolation, driving, images, walls, batches and refusals."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from tests.scenes import scene, simulate
from tests.sources.fields import fields
from tisim import Box, InputError, Scene
from tisim.backend import runtime
from tisim.components import serialization
from tisim.effects import StokesDrag
from tisim.sources import (
    Cylinder,
    FieldSampler,
    PoreFlow,
    SolidCylinder,
    SolidSphere,
    Sphere,
    sample,
    stokes_flow,
)
from tisim.sources.pore_flow import pore_flow

MM = 1e-3
LOW, HIGH = (-1 * MM, 0.0, 2 * MM), (1 * MM, 1.5 * MM, 4 * MM)
FIBRE = Cylinder(centre=(0.1 * MM, 0.7 * MM, 3.1 * MM), axis=(2, 1, -2), radius=0.35 * MM, length=1.5 * MM)
BALL = Sphere(centre=(-0.9 * MM, 1.4 * MM, 2.1 * MM), radius=0.3 * MM)
SETUP = {
    "low": LOW, "high": HIGH, "cells": (16, 12, 16), "viscosity": 1e-3, "speed": 2e-3,
    "cylinders": (FIBRE,), "spheres": (BALL,),
}  # fmt: skip
SIDES = np.subtract(HIGH, LOW)


def flow(**changes):
    return PoreFlow(**{**SETUP, **changes})


BODIES = [
    SolidCylinder(FIBRE.centre, FIBRE.direction, FIBRE.radius, FIBRE.length),
    SolidSphere(BALL.centre, BALL.radius),
]
LAYER = 2 / 16 * MM
"""One cell, m; cells are 2/16 mm, 1.5/12 mm and 2/16 mm."""


def solved(cells=(16, 12, 16), fall=(0.0, 0.0, 1.0), viscosity=1e-3):
    """The same matrix given to the solver."""
    return stokes_flow(BODIES, LOW, HIGH, cells, tuple(-np.array(fall)), viscosity)


def close():
    return 1e-9 if runtime.current().precision == "f64" else 3e-5


@pytest.fixture(scope="module")
def usual():
    """Samples the usual flow; compiled once."""
    source = flow()
    with FieldSampler([source], source.quantity) as field:
        yield field


def splines(found, points):
    """Velocities at points from those on faces, by basis splines of scipy: of degree 2 along a component and
    1 across it."""
    velocity = np.zeros((len(points), 3))
    for a in range(3):
        weights = []
        for b in range(3):
            n, degree = found.grid.shape[b], 2 if a == b else 1
            basis = BSpline.basis_element(np.arange(degree + 2) - (degree + 1) / 2, extrapolate=False)
            place = (points[:, b] - LOW[b]) / found.grid.spacing[b]
            apart = place[:, None] - np.arange(n) - (0.0 if a == b else 0.5)
            weights.append(np.nan_to_num(basis((apart + n / 2) % n - n / 2)))
        velocity[:, a] = np.einsum("pi,pj,pk,ijk->p", *weights, found.velocity[a])
    return velocity


def depth(points):
    """Distances from surfaces in layers, interpolated linearly between the corners of cells."""
    grid = solved().grid
    hat = BSpline.basis_element([-1, 0, 1], extrapolate=False)
    weights = []
    for b, n in enumerate(grid.shape):
        apart = ((points[:, b] - LOW[b]) / grid.spacing[b])[:, None] - np.arange(n)
        weights.append(np.nan_to_num(hat((apart + n / 2) % n - n / 2)))
    corners = np.minimum(grid.distances(None, BODIES) / LAYER, 3)
    return np.einsum("pi,pj,pk,ijk->p", *weights, corners)


def reference(points, h=1e-9):
    """Velocities at a superficial velocity of 2 mm/s, with the layer at surfaces."""
    found, near = solved(), depth(points)
    normal = np.stack([depth(points + h * e) - depth(points - h * e) for e in np.eye(3)], axis=1)
    normal /= np.linalg.norm(normal, axis=1)[:, None] + 1e-300
    part = np.clip(near, 0, 1)[:, None]
    v = splines(found, points + (1 - part) * LAYER * normal) * 2e-3 / found.mean_velocity[2]
    across = (v * normal).sum(axis=1)[:, None] * normal
    return np.where(part < 1, part * (v - across) + part**2 * across, v)


def test_velocity_between_faces_is_that_of_basis_splines_and_vanishes_at_surfaces(rng, usual):
    points = np.array(LOW) + SIDES * rng.uniform(-1.5, 2.5, (500, 3))
    layer = (depth(points) > 0) & (depth(points) < 1)
    assert layer.sum() > 50
    assert (depth(points) < 0).sum() > 30
    velocity, _ = usual(points)
    np.testing.assert_allclose(velocity, reference(points), atol=max(30 * close(), 1e-6) * 2e-3)
    assert (velocity[depth(points) < -1e-3] == 0).all()
    images, _ = usual(points + SIDES * [3, -2, 1])
    np.testing.assert_allclose(images, velocity, atol=100 * close() * 2e-3)


def test_the_gradient_is_the_derivative_and_has_no_trace_beyond_the_layer(rng, usual):
    points = np.array(LOW) + SIDES * rng.uniform(-1, 2, (500, 3))
    _, gradient = usual(points)
    scale, h = abs(gradient).max(), 1e-5 * MM
    trace = abs(np.trace(gradient, axis1=1, axis2=2))
    beyond = depth(points) > 1.01
    assert trace[beyond].max() < 30 * close() * scale
    wrong, divergence = np.zeros(len(points)), np.zeros(len(points))
    for b, step in enumerate(h * np.eye(3)):
        slope = (reference(points + step) - reference(points - step)) / (2 * h)
        wrong = np.maximum(wrong, abs(gradient[..., b] - slope).max(axis=1))
        divergence += slope[:, b]
    # Derivatives jump at few of the points.
    assert np.quantile(wrong[beyond], 0.98) < max(1e-6, 30 * close()) * scale
    # Without the curvature of surfaces, whose radius is 3 layers.
    inside = (depth(points) > 0.01) & ~beyond
    steep = np.sqrt((gradient[inside] ** 2).sum(axis=(1, 2)).mean())
    assert np.sqrt((divergence[inside] ** 2).mean()) < 0.35 * steep
    assert np.sqrt((wrong[inside] ** 2).mean()) < 0.15 * scale


def test_the_mean_over_the_box_is_the_superficial_velocity(usual):
    places = [np.array(LOW)[b] + SIDES[b] * (np.arange(n) + 0.37) / n for b, n in enumerate((16, 12, 16))]
    points = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 3)
    velocity, _ = usual(points)
    mean = solved().mean_velocity
    # Splines keep it; the layer at surfaces, 1.3 cells of a fibre 5.6 cells thick, takes a little away.
    np.testing.assert_allclose(velocity.mean(axis=0), mean / mean[2] * 2e-3, atol=0.03 * 2e-3)


def test_the_flow_begins_and_ends(rng):
    places, switched = rng.uniform(LOW, HIGH, (20, 3)), flow(begin=2.0, end=3.0)
    with FieldSampler([switched], switched.quantity) as field:
        always = field(places, 2.5)
        assert all(np.abs(one).max() > 0 for one in always)
        for time, acts in ((0.0, 0), (1.999, 0), (2.0, 1), (3.0, 0)):
            for found, expected in zip(field(places, time), always, strict=True):
                np.testing.assert_array_equal(found, acts * expected)


def test_a_pressure_gradient_drives_by_darcys_law():
    source = flow(speed=None, pressure_gradient=30.0)
    found = solved(fall=(0.0, 0.0, 30.0))
    assert source.permeability() == pytest.approx(found.permeability, rel=1e-9)
    assert source.superficial_speed() == pytest.approx(found.mean_velocity[2], rel=1e-9)
    points = np.array([[0.0, 0.1 * MM, 2.2 * MM]])
    velocity, _ = sample((source,), "flow_velocity", points)
    assert depth(points) > 1
    np.testing.assert_allclose(velocity, splines(found, points), rtol=1e3 * close())


def test_flows_of_one_matrix_are_solved_once(monkeypatch):
    solutions = []

    def count(*arguments, **options):
        solutions.append(arguments)
        return stokes_flow(*arguments, **options)

    monkeypatch.setattr(pore_flow, "stokes_flow", count)
    pore_flow._solved.clear()
    magnetised = FIBRE.model_copy(update={"magnetisation": (1e5, 0.0, 0.0)})
    same = (
        flow(), flow(speed=5e-3), flow(viscosity=1.0, speed=None, pressure_gradient=3.0),
        flow(direction=(0, 0, 7)), flow(cylinders=(magnetised,)), flow(outside="uniform"),
    )  # fmt: skip
    assert len({id(source.solve()) for source in same}) == 1
    assert len(solutions) == 1
    for other in (flow(direction=(0, 1, 0)), flow(spheres=()), flow(cells=(16, 14, 16))):
        other.solve()
    assert len(solutions) == 4
    monkeypatch.setattr(pore_flow, "KEPT_FLOW_BYTES", 1)
    flow(tolerance=1e-3).solve()
    assert len(pore_flow._solved) == 1


@pytest.mark.slow
def test_worlds_of_a_batch_have_their_own_matrices(rng):
    """Also of other numbers of bodies and cells, directions and boxes; the same bits as alone."""
    sources = [
        flow(),
        flow(cylinders=(), direction=(1, -1, 0), speed=1e-3),
        flow(spheres=(BALL, BALL.model_copy(update={"centre": (0.0, 0.0, 2 * MM)}))),
        flow(high=(1 * MM, 2 * MM, 4 * MM), speed=None, pressure_gradient=5.0, cells=(20, 20, 40)),
    ]
    room = sources[-1].room()
    assert sources[0].structure() != sources[-1].structure()
    assert len({source.with_room(room).structure() for source in sources}) == 1
    points = np.array(LOW) + SIDES * rng.uniform(0, 1, (40, 3))
    velocity, gradient = fields(sources, np.stack([points] * 4))
    for w, source in enumerate(sources):
        alone, slope = sample((source,), "flow_velocity", points)
        np.testing.assert_array_equal(velocity[w], alone)
        np.testing.assert_array_equal(gradient[w], slope)
    assert (velocity[0] != velocity[2]).any()


def test_outside_of_a_free_filter_the_velocity_is_uniform(rng, usual):
    source = flow(outside="uniform")
    mean = solved().mean_velocity
    points = np.array(LOW) + SIDES * rng.uniform(-2, 3, (300, 3))
    inside = ((points >= LOW) & (points <= HIGH)).all(axis=1)
    velocity, gradient = sample((source,), "flow_velocity", points)
    within, _ = usual(points)
    np.testing.assert_array_equal(velocity[inside], within[inside])
    expected = np.broadcast_to(mean / mean[2] * 2e-3, velocity[~inside].shape)
    np.testing.assert_allclose(velocity[~inside], expected, rtol=10 * close(), atol=1e-12)
    assert (gradient[~inside] == 0).all()
    assert inside.any()


def test_walls_hold_the_fluid_and_space_beyond_is_at_rest():
    """Poiseuille in a tube: 2 U (1 - r^2/R^2); a duct is slower at its edges."""
    low, high = (0.0, -1 * MM, -1 * MM), (2 * MM, 1 * MM, 1 * MM)
    tube = PoreFlow(
        low=low, high=high, cells=(2, 40, 40), direction=(1, 0, 0), axis="x", column="tube",
        speed=np.pi / 4 * MM, viscosity=1e-3,
    )  # fmt: skip
    y = np.linspace(-3 * MM, 3 * MM, 241)
    points = np.stack([0 * y, 0.6 * y, 0.8 * y], axis=-1)
    velocity, gradient = sample((tube,), "flow_velocity", points)
    expected = np.where(abs(y) < MM, 2 * MM * (1 - (y / MM) ** 2), 0)
    np.testing.assert_allclose(velocity[:, 0], expected, atol=0.012 * MM)
    assert (velocity[abs(y) > 1.01 * MM] == 0).all()
    assert (gradient[abs(y) > 1.01 * MM] == 0).all()
    assert abs(velocity[:, 1:]).max() < 1e-4 * MM


@pytest.mark.slow
def test_the_speed_at_a_surface_falls_with_the_spacing(rng):
    """It is of second order, and particles that follow the fluid hardly cross a surface."""
    z = rng.uniform(-0.4, 0.4, 500)
    n = np.array(FIBRE.direction)
    e = np.cross(n, [1.0, 0, 0]) / np.linalg.norm(np.cross(n, [1.0, 0, 0]))
    around = 2 * np.pi * rng.uniform(size=500)
    out = np.cos(around)[:, None] * e + np.sin(around)[:, None] * np.cross(n, e)
    slip, through = [], []
    for m in (1, 2, 4):
        source = flow(cells=(16 * m, 12 * m, 16 * m))
        surface = FIBRE.centre + z[:, None] * FIBRE.length * n + FIBRE.radius * out
        v = sample((source,), "flow_velocity", surface)[0] / 2e-3
        slip.append(np.sqrt((v**2).sum(axis=1).mean()))
        through.append(np.sqrt(((v * out).sum(axis=1) ** 2).mean()))
        deep = surface - 0.05 * SIDES[0] / (16 * m) * out
        assert abs(sample((source,), "flow_velocity", deep)[0]).max() < slip[-1] * 2e-3
    assert slip[0] < 0.04
    assert through[0] < 2e-3
    for values in (slip, through):
        assert values[1] < 0.4 * values[0]
        assert values[2] < 0.4 * values[1]


def test_bounds_hold(usual):
    source = flow()
    points = np.array(LOW) + SIDES * np.random.default_rng(3).uniform(size=(2000, 3))
    velocity, gradient = usual(points)
    assert np.linalg.norm(velocity, axis=1).max() <= source.strongest() < 10 * 2e-3 * 3
    assert source.shortest_length() == pytest.approx(min(SIDES / (16, 12, 16)))
    assert flow(cells=(16, 12, 1), spheres=()).shortest_length() == pytest.approx(min(SIDES[:2] / (16, 12)))
    assert abs(gradient).max() > 0


def drifting(source, domain=None, radius=1e-6):
    return scene(
        [[-0.8 * MM, 0.2 * MM, 2.3 * MM]], [[0, 0, 0]], (source, StokesDrag(viscosity=1e-3)),
        radius=radius, mass=1e-15, duration=0.05, **({"domain": domain} if domain else {}),
    )  # fmt: skip


@pytest.mark.slow
def test_a_light_particle_follows_the_fluid():
    (result,) = simulate([drifting(flow())], capacity=4)
    velocity, _ = sample((flow(),), "flow_velocity", result.state["position"])
    np.testing.assert_allclose(result.state["velocity"], velocity, rtol=0, atol=2e-3 * 2e-3)
    assert np.linalg.norm(result.state["position"] - [[-0.8 * MM, 0.2 * MM, 2.3 * MM]]) > 0.02 * MM


def test_a_scene_file_holds_fibres_and_numbers_only():
    setup = drifting(flow())
    text = serialization.toml(setup.to_dict())
    assert len(text) < 3000
    again = Scene.from_dict(setup.to_dict())
    assert again.effects[0] == setup.effects[0]


def test_a_periodic_domain_must_hold_whole_periods():
    twice = Box(low=LOW, high=tuple(np.array(LOW) + SIDES * [2, 1, 3]))
    drifting(flow(), twice)
    wrong = Box(low=LOW, high=tuple(np.array(LOW) + SIDES * [2, 1, 1.5]))
    with pytest.raises(InputError) as fault:
        drifting(flow(), wrong)
    assert str(fault.value) == (
        "the box of pore_flow must be a whole part of the side of the periodic domain along z;"
        " received 0.666667 of it"
    )
    drifting(flow(), wrong.model_copy(update={"periodic": (True, True, False)}))
    drifting(flow(outside="uniform"), wrong)


WRONG = {
    "pore_flow.pressure_gradient must be given, or pore_flow.speed, and not both; received neither": {
        "speed": None
    },
    "pore_flow.pressure_gradient must be given, or pore_flow.speed, and not both; received both": {
        "pressure_gradient": 1.0
    },
    "pore_flow.high must be above pore_flow.low in every component; received (0.0, 0.0, -1.0)": {
        "high": (0, 0, -1)
    },
    "pore_flow.cells must be whole numbers, at least 1; received (4, 0, 4)": {"cells": (4, 0, 4)},
    "pore_flow.cylinders must be given, or spheres, or a column with walls; received none of them": {
        "cylinders": (),
        "spheres": (),
    },
    "pore_flow.outside must be 'periodic' with a column; received 'uniform'": {
        "outside": "uniform",
        "column": "duct",
    },
    "pore_flow.direction must be along the duct, z; received (1.0, 0.0, 1.0)": {
        "direction": (1, 0, 1),
        "column": "duct",
    },
    "pore_flow.direction must be a direction; received (0.0, 0.0, 0.0)": {"direction": (0, 0, 0)},
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        flow(**WRONG[message])
    assert str(fault.value) == message


def test_a_blocked_matrix_is_refused_before_a_run():
    plug = Cylinder(centre=(0, 0, 3 * MM), radius=3 * MM, length=0.5 * MM)
    with pytest.raises(InputError, match="pores must be open along the pressure gradient"):
        simulate([drifting(flow(cylinders=(plug,)))], capacity=4)


@pytest.mark.slow
def test_grids_of_one_cell_and_places_that_are_no_numbers(rng):
    """A matrix that does not change along z needs one cell there; other memory is not read for a NaN."""
    through = Cylinder(centre=(0.2 * MM, 0.7 * MM, 3.0 * MM), axis=(0, 0, 1), radius=0.35 * MM, length=9 * MM)
    points = np.array(LOW) + SIDES * rng.uniform(0, 1, (30, 3))
    points[0], points[1, 2] = np.nan, np.inf
    one, many = (
        flow(cylinders=(through,), spheres=(), direction=(1, 0, 0), cells=(16, 12, number))
        for number in (1, 4)
    )
    velocity, _ = fields([one, many], np.stack([points] * 2))
    assert np.isnan(velocity[:, :2]).all()
    np.testing.assert_allclose(velocity[0, 2:], velocity[1, 2:], rtol=0, atol=1e-3 * 2e-3)
    assert np.abs(velocity[0, 2:]).max() > 2e-3
