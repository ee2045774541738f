"""The flow between two sliding walls compared with its closed form, and a grain dragged by it."""

import numpy as np
import pytest

from tests.scenes import scene, simulate
from tisim import InputError
from tisim.effects import StokesDrag
from tisim.sources import CouetteFlow, sample
from tisim.steppers import ErrorControl, Trapezoid

N = np.array([1.0, -2.0, 2.0])
LOW, HIGH = np.array([2.0, 2.0, 1.0]), np.array([-4.0, 0.0, 2.0])
"""Velocities (m/s), perpendicular to the given wall normal."""
FLOW = CouetteFlow(
    normal=tuple(N), first=-0.5, second=1.5, first_velocity=tuple(LOW), second_velocity=tuple(HIGH)
)


def test_velocity_and_gradient_are_linear_between_the_walls(rng):
    x, along = rng.uniform(-0.5, 1.5, 20), rng.normal(size=(20, 3))
    n = N / 3
    points = x[:, None] * n + along - (along @ n)[:, None] * n
    velocity, gradient = sample((FLOW,), "flow_velocity", points)
    np.testing.assert_allclose(velocity, LOW + ((x + 0.5) / 2)[:, None] * (HIGH - LOW), rtol=0, atol=1e-5)
    np.testing.assert_allclose(gradient, np.broadcast_to(np.outer(HIGH - LOW, n) / 2, (20, 3, 3)), atol=1e-5)
    np.testing.assert_allclose(np.trace(gradient, axis1=1, axis2=2), 0, atol=1e-5)


def test_beyond_a_wall_the_fluid_moves_with_it():
    velocity, gradient = sample((FLOW,), "flow_velocity", [-0.7 * N / 3, 1.6 * N / 3, 9 * N])
    np.testing.assert_allclose(velocity, [LOW, HIGH, HIGH], rtol=1e-6)
    assert (gradient == 0).all()


def test_the_fluid_is_at_rest_until_the_walls_move():
    late = FLOW.model_copy(update={"begin": 2.0})
    for t, part in ((1.99, 0.0), (2.0, 1.0)):
        velocity, gradient = sample((late,), "flow_velocity", [0.5 * N / 3], t)
        np.testing.assert_allclose(velocity[0], part * (LOW + HIGH) / 2, rtol=1e-6)
        np.testing.assert_allclose(gradient[0], part * np.outer(HIGH - LOW, N / 3) / 2, rtol=1e-5, atol=1e-6)


@pytest.mark.slow
def test_a_grain_moves_with_its_layer():
    """From rest, v = v_f (1 - exp(-t/tau)): the flow along the wall keeps the grain in its layer."""
    flow = CouetteFlow(first=-1.0, second=3.0, first_velocity=(-1, 0, 0), second_velocity=(7, 4, 0))
    tau = 2.0 / (6 * np.pi * 0.5 * 0.1)
    setup = scene(
        [[0, 0, 0.5]],
        [[0, 0, 0]],
        (flow, StokesDrag(viscosity=0.5)),
        radius=0.1,
        mass=2.0,
        stepper=Trapezoid(control=ErrorControl(error=1e-8, tolerance=1e-10, first=1e-3, longest=0.1)),
        duration=3.0,
    )
    (result,) = simulate([setup], capacity=4)
    expected = np.array([2.0, 1.5, 0.0]) * (1 - np.exp(-3.0 / tau))
    np.testing.assert_allclose(result.state["velocity"][0], expected, rtol=1e-6)


WRONG = {
    "couette_flow.second must be above couette_flow.first; received 0.0": {"second": 0.0},
    "couette_flow.normal must be a direction; received (0.0, 0.0, 0.0)": {"normal": (0, 0, 0)},
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    right = {"first": 0.0, "second": 1.0, "first_velocity": (0, 0, 0), "second_velocity": (1, 0, 0)}
    with pytest.raises(InputError) as fault:
        CouetteFlow(**{**right, **WRONG[message]})
    assert str(fault.value) == message
