"""Spheres slowed by drag alone, compared with the closed forms of Z16 (4.11) and (A.11), for each stepper."""

import numpy as np
import pytest

from tests.scenes import scene, simulate
from tests.steppers.charged import boris, equal_steps, order
from tests.steppers.closed_forms import quadratic_drag, stokes_drag
from tisim.effects import ConstantDrag, StokesDrag

DURATION, RHO = 2.0, 900.0
"""Duration (s), and density of the spheres (kg/m^3)."""
STEPS = 2 ** np.arange(6, 10)
STEPPERS = {
    "trapezoid": lambda n: equal_steps(DURATION / n),
    "boris": lambda n: boris(DURATION / n),
}
GRID = [(r, f, v) for r in (1e-3, 4e-3) for f in (0.3, 1.5) for v in (0.5, 6.0)]
"""Radius (m), a factor for the drag of the fluid, initial speed (m/s)."""


def constant(r, factor, v):
    """The law and the distance travelled: K = 3 C_D rho_a/(8 rho R), with rho_a = 1.2 kg/m^3."""
    law = ConstantDrag(density=1.2, coefficient=factor)
    return law, quadratic_drag(DURATION, v, 3 * factor * 1.2 / (8 * RHO * r))


def stokes(r, factor, v):
    """The law and the distance travelled: rate = 9 mu/(2 rho R^2), with mu = 1 mPa s."""
    viscosity = factor * 1e-3
    return StokesDrag(viscosity=viscosity), stokes_drag(DURATION, v, 9 * viscosity / (2 * RHO * r**2))


@pytest.mark.long
@pytest.mark.parametrize(
    ("form", "name"),
    [
        (constant, "trapezoid"),
        (stokes, "boris"),
        pytest.param(constant, "boris", marks=pytest.mark.slow),
        pytest.param(stokes, "trapezoid", marks=pytest.mark.slow),
    ],
)
def test_distance_and_its_order(form, name):
    """All parameters at once with four step lengths each: order 2, along a direction that is not an axis."""
    along = np.array([2.0, -1.0, 2.0]) / 3
    scenes, expected = [], []
    for r, factor, v in GRID:
        law, distance = form(r, factor, v)
        expected.append(distance)
        for n in STEPS.tolist():
            more = {"density": RHO, "stepper": STEPPERS[name](n), "duration": DURATION}
            scenes.append(scene([[0.0, 0.0, 0.0]], [v * along], (law,), radius=r, **more))
    results = simulate(scenes, worlds=len(scenes), capacity=1)
    assert all(result.status.ok for result in results)
    places = np.array([result.state["position"][0] for result in results])
    errors = np.linalg.norm(places - np.repeat(expected, len(STEPS))[:, None] * along, axis=1)
    for label, errors_of_steps, distance in zip(GRID, errors.reshape(len(GRID), -1), expected, strict=True):
        assert order(STEPS, errors_of_steps) == pytest.approx(2.0, abs=0.02), label
        assert errors_of_steps[-1] < 2e-5 * distance, label
