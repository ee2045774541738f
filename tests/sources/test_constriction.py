"""The flow through a constriction compared with L21's profile in NumPy, its gradient and its flow rate."""

import numpy as np
import pytest
from scipy.integrate import quad

from tisim import InputError
from tisim.sources import ConstrictionFlow, sample

AXIS = np.array([2.0, 1.0, -2.0]) / 3
CENTRE = np.array([0.1, -0.2, 0.3])
ACROSS = np.array([1.0, 2.0, 2.0]) / 3, np.array([2.0, -2.0, 1.0]) / 3
SHAPE = {
    "centre": tuple(CENTRE),
    "axis": tuple(7 * AXIS),
    "speed": 0.5,
    "throat_radius": 1.0,
    "duct_radius": 2.5,
    "length": 3.0,
}


def profile(z, rho, transition):
    """L21 section 3.4.4, with linear transitions before and after the constriction."""
    across = np.clip((2.5 - rho) / 1.5, 0, 1)
    part = np.where(np.abs(z) <= 1.5, 1.0, 0.0)
    if transition:
        part = np.clip(1 - (np.abs(z) - 1.5) / transition, 0, 1)
    return 0.5 * across * (1 + (2.5**2 - 1) * part * (rho <= 1.0))


def places(z, rho, angle):
    """Points with these positions along the axis, distances from it and angles around it."""
    around = np.cos(angle)[:, None] * ACROSS[0] + np.sin(angle)[:, None] * ACROSS[1]
    return CENTRE + z[:, None] * AXIS + rho[:, None] * around


@pytest.mark.parametrize("transition", [0.0, 0.8])
def test_the_velocity_follows_the_profile(transition, rng):
    z, rho, angle = rng.uniform(-4, 4, 200), rng.uniform(0, 3, 200), rng.uniform(0, 2 * np.pi, 200)
    flow = ConstrictionFlow(**SHAPE, transition=transition)
    velocity, _ = sample((flow,), "flow_velocity", places(z, rho, angle))
    expected = profile(z, rho, transition)[:, None] * AXIS
    np.testing.assert_allclose(velocity, expected, rtol=0, atol=2e-6)


def test_gradient_is_the_derivative_and_its_trace_is_not_zero_in_the_transitions(rng):
    """Compared with central differences of the reference implementation, away from its edges."""
    z, rho, angle = rng.uniform(-4, 4, 400), rng.uniform(0.01, 3, 400), rng.uniform(0, 2 * np.pi, 400)
    h, apart = 1e-6, 1e-3
    edges = (np.abs(np.abs(z) - 1.5), np.abs(np.abs(z) - 2.3), np.abs(rho - 1.0), np.abs(rho - 2.5))
    keep = np.min(edges, axis=0) > apart
    z, rho, angle = z[keep], rho[keep], angle[keep]
    points = places(z, rho, angle)
    flow = ConstrictionFlow(**SHAPE, transition=0.8)
    _, gradient = sample((flow,), "flow_velocity", points)

    def reference(r):
        along = (r - CENTRE) @ AXIS
        return profile(along, np.linalg.norm(r - CENTRE - along[:, None] * AXIS, axis=1), 0.8)

    for axis in range(3):
        step = h * np.eye(3)[axis]
        difference = (reference(points + step) - reference(points - step)) / (2 * h)
        np.testing.assert_allclose(gradient[..., axis], difference[:, None] * AXIS, atol=1e-5)
    divergence = np.trace(gradient, axis1=1, axis2=2)
    inside = (np.abs(z) > 1.5) & (np.abs(z) < 2.3) & (rho < 1.0)
    assert inside.sum() > 5
    expected = np.where(inside, 0.5 * (1 - 2.5**2) / 0.8 * np.sign(z), 0.0)
    np.testing.assert_allclose(divergence, expected, atol=1e-5)


def test_the_flow_rate_is_larger_in_the_constriction():
    """The flow rate ratio is 3 R^2 / (R^2 + R R_c + R_c^2), as stated in its docstring."""
    flow, rho = ConstrictionFlow(**SHAPE), np.linspace(0, 2.5, 2001)

    def through(z, end):
        speed = sample((flow,), "flow_velocity", places(np.full_like(rho, z), rho, 0 * rho))[0] @ AXIS
        return quad(lambda x: 2 * np.pi * x * np.interp(x, rho, speed), 0, end, limit=200, points=[1.0])[0]

    expected = 3 * 2.5**2 / (2.5**2 + 2.5 + 1)
    # The wall of the constriction is at 1.
    assert through(0.0, 1.0) / through(5.0, 2.5) == pytest.approx(expected, rel=1e-4)


def test_on_the_axis_nothing_is_divided_by_zero():
    velocity, gradient = sample((ConstrictionFlow(**SHAPE),), "flow_velocity", [CENTRE, CENTRE + 9 * AXIS])
    np.testing.assert_allclose(velocity, [0.5 * 6.25 * AXIS, 0.5 * AXIS], rtol=1e-6)
    assert (gradient == 0).all()


WRONG = {
    "constriction_flow.throat_radius must be below constriction_flow.duct_radius; received 2.5": {
        "throat_radius": 2.5
    },
    "constriction_flow.axis must be a direction; received (0.0, 0.0, 0.0)": {"axis": (0, 0, 0)},
    "constriction_flow.transition must be at least 0.0; received -1": {"transition": -1},
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        ConstrictionFlow(**{**SHAPE, **WRONG[message]})
    assert str(fault.value) == message
