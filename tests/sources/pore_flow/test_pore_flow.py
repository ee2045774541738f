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
from tisim.sources import Cylinder, PoreFlow, SolidCylinder, SolidSphere, Sphere, sample, stokes_flow
from tisim.sources.pore_flow import pore_flow

MM = 1e-3
LOW, HIGH = (-1 * MM, 0.0, 2 * MM), (1 * MM, 1.5 * MM, 4 * MM)
FIBRE = Cylinder(centre=(0.1 * MM, 0.7 * MM, 3.1 * MM), axis=(2, 1, -2), radius=0.35 * MM, length=1.5 * MM)
BALL = Sphere(centre=(-0.9 * MM, 1.4 * MM, 2.1 * MM), radius=0.3 * MM)
SETUP = {
    "low": LOW, "high": HIGH, "cells": (16, 12, 18), "viscosity": 1e-3, "speed": 2e-3,
    "cylinders": (FIBRE,), "spheres": (BALL,),
}  # fmt: skip
SIDES = np.subtract(HIGH, LOW)


def flow(**changes):
    return PoreFlow(**{**SETUP, **changes})


def solved(cells=(16, 12, 18), fall=(0.0, 0.0, 1.0), viscosity=1e-3):
    """The same matrix given to the solver."""
    bodies = [
        SolidCylinder(FIBRE.centre, FIBRE.direction, FIBRE.radius, FIBRE.length),
        SolidSphere(BALL.centre, BALL.radius),
    ]
    return stokes_flow(bodies, LOW, HIGH, cells, tuple(-np.array(fall)), viscosity)


def close():
    return 1e-9 if runtime.current().precision == "f64" else 3e-5


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


def test_velocity_between_faces_is_that_of_basis_splines(rng):
    points = np.array(LOW) + SIDES * rng.uniform(-1.5, 2.5, (300, 3))
    found = solved()
    expected = splines(found, points) * 2e-3 / found.mean_velocity[2]
    velocity, _ = sample((flow(),), "flow_velocity", points)
    np.testing.assert_allclose(velocity, expected, atol=30 * close() * 2e-3)
    images, _ = sample((flow(),), "flow_velocity", points + SIDES * [3, -2, 1])
    np.testing.assert_allclose(images, velocity, atol=100 * close() * 2e-3)


def test_the_gradient_is_the_derivative_and_has_no_trace(rng):
    points = np.array(LOW) + SIDES * rng.uniform(-1, 2, (300, 3))
    _, gradient = sample((flow(),), "flow_velocity", points)
    scale = abs(gradient).max()
    assert abs(np.trace(gradient, axis1=1, axis2=2)).max() < 30 * close() * scale
    found, h = solved(), 1e-5 * MM
    for b, step in enumerate(h * np.eye(3)):
        slope = (splines(found, points + step) - splines(found, points - step)) / (2 * h)
        expected = slope * 2e-3 / found.mean_velocity[2]
        # Derivatives jump at few of the points.
        wrong = abs(gradient[..., b] - expected).max(axis=1)
        assert np.quantile(wrong, 0.98) < max(1e-6, 30 * close()) * scale


def test_the_mean_over_the_box_is_the_superficial_velocity():
    places = [np.array(LOW)[b] + SIDES[b] * (np.arange(n) + 0.37) / n for b, n in enumerate((16, 12, 18))]
    points = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 3)
    velocity, _ = sample((flow(),), "flow_velocity", points)
    mean = solved().mean_velocity
    np.testing.assert_allclose(velocity.mean(axis=0), mean / mean[2] * 2e-3, atol=10 * close() * 2e-3)


def test_a_pressure_gradient_drives_by_darcys_law():
    source = flow(speed=None, pressure_gradient=30.0)
    found = solved(fall=(0.0, 0.0, 30.0))
    assert source.permeability() == pytest.approx(found.permeability, rel=1e-9)
    assert source.superficial_speed() == pytest.approx(found.mean_velocity[2], rel=1e-9)
    points = np.array([[0.0, 0.1 * MM, 2.2 * MM]])
    velocity, _ = sample((source,), "flow_velocity", points)
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
    for other in (flow(direction=(0, 1, 0)), flow(spheres=()), flow(cells=(16, 14, 18))):
        other.solve()
    assert len(solutions) == 4
    monkeypatch.setattr(pore_flow, "KEPT_BYTES", 1)
    flow(tolerance=1e-3).solve()
    assert len(pore_flow._solved) == 1


def test_worlds_of_a_batch_have_their_own_matrices(rng):
    """Also of other numbers of bodies, directions and boxes."""
    sources = [
        flow(),
        flow(cylinders=(), direction=(1, -1, 0), speed=1e-3),
        flow(spheres=(BALL, BALL.model_copy(update={"centre": (0.0, 0.0, 2 * MM)}))),
        flow(high=(1 * MM, 2 * MM, 4 * MM), speed=None, pressure_gradient=5.0),
    ]
    assert len({source.structure() for source in sources}) == 1
    points = np.array(LOW) + SIDES * rng.uniform(0, 1, (40, 3))
    velocity, gradient = fields(sources, np.stack([points] * 4))
    for w, source in enumerate(sources):
        alone, slope = sample((source,), "flow_velocity", points)
        np.testing.assert_array_equal(velocity[w], alone)
        np.testing.assert_array_equal(gradient[w], slope)
    assert (velocity[0] != velocity[2]).any()


def test_outside_of_a_free_filter_the_velocity_is_uniform(rng):
    source = flow(outside="uniform")
    mean = solved().mean_velocity
    points = np.array(LOW) + SIDES * rng.uniform(-2, 3, (300, 3))
    inside = ((points >= LOW) & (points <= HIGH)).all(axis=1)
    velocity, gradient = sample((source,), "flow_velocity", points)
    within, _ = sample((flow(),), "flow_velocity", points)
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
    # Velocities are linear between faces; the wall is within a cell, 0.05 mm.
    near = abs(abs(y) - MM) < 0.06 * MM
    np.testing.assert_allclose(velocity[~near, 0], expected[~near], atol=0.01 * MM)
    np.testing.assert_allclose(velocity[near, 0], expected[near], atol=0.1 * MM)
    beyond = abs(y) > 1.3 * MM
    assert abs(velocity[beyond]).max() < 1e-4 * MM
    assert abs(gradient[abs(y) > 2 * MM]).max() == 0
    assert abs(velocity[:, 1:]).max() < 1e-4 * MM


def test_the_speed_at_a_surface_falls_with_the_spacing(rng):
    """As a part of the superficial speed it is of first order, and vanishes a cell inside the body."""
    z = rng.uniform(-0.4, 0.4, 500)
    n = np.array(FIBRE.direction)
    e = np.cross(n, [1.0, 0, 0]) / np.linalg.norm(np.cross(n, [1.0, 0, 0]))
    around = 2 * np.pi * rng.uniform(size=500)
    out = np.cos(around)[:, None] * e + np.sin(around)[:, None] * np.cross(n, e)
    slip = []
    for m in (1, 2, 4):
        source = flow(cells=(16 * m, 12 * m, 16 * m))
        surface = FIBRE.centre + z[:, None] * FIBRE.length * n + FIBRE.radius * out
        v = np.linalg.norm(sample((source,), "flow_velocity", surface)[0], axis=1) / 2e-3
        slip.append(np.sqrt((v**2).mean()))
        deep = surface - 1.75 * SIDES[0] / (16 * m) * out
        v = np.linalg.norm(sample((source,), "flow_velocity", deep)[0], axis=1) / 2e-3
        assert v.max() < 5e-3
    assert slip[0] < 0.5
    assert slip[1] < 0.65 * slip[0]
    assert slip[2] < 0.65 * slip[1]


def test_bounds_hold():
    source = flow()
    points = np.array(LOW) + SIDES * np.random.default_rng(3).uniform(size=(2000, 3))
    velocity, gradient = sample((source,), "flow_velocity", points)
    assert np.linalg.norm(velocity, axis=1).max() <= source.strongest() < 10 * 2e-3 * 3
    assert source.shortest_length() == pytest.approx(min(SIDES / (16, 12, 18)))
    assert flow(cells=(16, 12, 1), spheres=()).shortest_length() == pytest.approx(min(SIDES[:2] / (16, 12)))
    assert abs(gradient).max() > 0


def drifting(source, domain=None, radius=1e-6):
    return scene(
        [[-0.8 * MM, 0.2 * MM, 2.3 * MM]], [[0, 0, 0]], (source, StokesDrag(viscosity=1e-3)),
        radius=radius, mass=1e-15, duration=0.05, **({"domain": domain} if domain else {}),
    )  # fmt: skip


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
